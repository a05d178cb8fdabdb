// Millions of shadow rays per second of Embree 3 or 4 on the segments of scripts/bench/segments.rs, one thread.
//
//     occlusion VERSION LIBRARY REPETITIONS SEGMENTS...
//
// Every vertex is connected to every receiver where both cosines are positive, in the order of the file. A ray
// starts at the vertex, has the whole way as its direction, and t in [0, 1]. Times are CPU time of the thread, the
// filling of the packets included, the choice of facing receivers not. The library is opened at run time, so that
// wheels without headers will do; the declarations below are the part of the two interfaces that is needed.

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <dlfcn.h>
#include <fstream>
#include <stdexcept>
#include <string>
#include <time.h>
#include <vector>
#include <xmmintrin.h>

namespace {

struct Vector {
    float x, y, z;
};

Vector operator-(Vector a, Vector b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
float dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

struct Place {
    Vector point, normal;
};

struct Segments {
    std::vector<Vector> corners;
    std::vector<Place> receivers, vertices;
};

Segments read(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    uint32_t counts[4];
    file.read(reinterpret_cast<char*>(counts), sizeof counts);
    Segments segments{std::vector<Vector>(3 * size_t(counts[0])), std::vector<Place>(counts[1]),
                      std::vector<Place>(counts[2])};
    auto fill = [&](auto& list) { file.read(reinterpret_cast<char*>(list.data()), list.size() * sizeof list[0]); };
    fill(segments.corners);
    fill(segments.receivers);
    fill(segments.vertices);
    if (!file) throw std::runtime_error("cannot read " + path);
    return segments;
}

// --- the interfaces of Embree 3 and 4, as far as needed ---------------------------------------------------------

using Handle = void*;
enum : int { TRIANGLES = 0, INDICES = 0, VERTICES = 1, UINT3 = 0x5003, FLOAT3 = 0x9003, ROBUST = 1 << 2 };
enum Quality : int { MEDIUM = 1, HIGH = 2 };

// A ray for N = 1, a packet of rays otherwise.
template <int N> struct alignas(N == 1 ? 16 : 4 * N) Rays {
    float x[N], y[N], z[N], near[N], dx[N], dy[N], dz[N], time[N], far[N];
    uint32_t mask[N], id[N], flags[N];
};

// RTCIntersectContext of Embree 3 without filter and instances.
struct Context3 {
    int flags;
    void* filter = nullptr;
    uint32_t instance = ~0u;
    uint32_t rest[7] = {};
};

// RTCOccludedArguments of Embree 4 without filter and instances.
struct Arguments4 {
    int flags;
    uint32_t features = ~0u;
    void* context = nullptr;
    void* filter = nullptr;
    void* occluded = nullptr;
    float rest[4] = {};
};

class Embree {
  public:
    Embree(int version, const char* path) : version_(version), library_(dlopen(path, RTLD_NOW)) {
        if (!library_) throw std::runtime_error(dlerror());
        if (version != 3 && version != 4) throw std::runtime_error("the version is 3 or 4");
        device_ = call<Handle>("rtcNewDevice", "threads=1");
    }

    Handle build(const Segments& segments, Quality quality, bool robust) const {
        Handle scene = call<Handle>("rtcNewScene", device_);
        call<void>("rtcSetSceneBuildQuality", scene, int(quality));
        call<void>("rtcSetSceneFlags", scene, robust ? ROBUST : 0);
        Handle mesh = call<Handle>("rtcNewGeometry", device_, int(TRIANGLES));
        size_t count = segments.corners.size();
        auto* corners = static_cast<Vector*>(buffer(mesh, VERTICES, FLOAT3, sizeof(Vector), count));
        std::copy(segments.corners.begin(), segments.corners.end(), corners);
        auto* indices = static_cast<uint32_t*>(buffer(mesh, INDICES, UINT3, 3 * sizeof(uint32_t), count / 3));
        for (size_t i = 0; i < count; i++) indices[i] = uint32_t(i);
        call<void>("rtcSetGeometryBuildQuality", mesh, int(quality));
        call<void>("rtcCommitGeometry", mesh);
        call<unsigned>("rtcAttachGeometry", scene, mesh);
        call<void>("rtcReleaseGeometry", mesh);
        call<void>("rtcCommitScene", scene);
        int error = call<int>("rtcGetDeviceError", device_);
        if (error) throw std::runtime_error("Embree error " + std::to_string(error));
        return scene;
    }

    void release(Handle scene) const { call<void>("rtcReleaseScene", scene); }

    // rtcOccludedN of the loaded version, to be called for rays of which `valid` says which are there.
    template <int N> auto occluded(Handle scene, bool coherent) const {
        void* function = find(("rtcOccluded" + std::to_string(N)).c_str());
        Context3 context{coherent ? 1 : 0};
        Arguments4 arguments{coherent ? 1 << 16 : 0};
        return [=, version = version_](const int* valid, Rays<N>& rays) mutable {
            void* options = version == 3 ? static_cast<void*>(&context) : &arguments;
            void* first = version == 3 ? options : &rays;
            void* second = version == 3 ? static_cast<void*>(&rays) : options;
            if constexpr (N == 1) {
                reinterpret_cast<void (*)(Handle, void*, void*)>(function)(scene, first, second);
            } else {
                reinterpret_cast<void (*)(const int*, Handle, void*, void*)>(function)(valid, scene, first, second);
            }
        };
    }

  private:
    int version_;
    void* library_;
    Handle device_;

    void* buffer(Handle mesh, int kind, int format, size_t stride, size_t count) const {
        return call<void*>("rtcSetNewGeometryBuffer", mesh, kind, 0u, format, stride, count);
    }

    void* find(const char* name) const {
        void* symbol = dlsym(library_, name);
        if (!symbol) throw std::runtime_error(std::string("no ") + name);
        return symbol;
    }

    template <class Result, class... Arguments> Result call(const char* name, Arguments... arguments) const {
        return reinterpret_cast<Result (*)(Arguments...)>(find(name))(arguments...);
    }
};

// --- the measurement --------------------------------------------------------------------------------------------

double thread_seconds() {
    timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

// A vertex and the receivers that it and they face; the last is repeated up to a multiple of PADDING.
struct Fan {
    Vector apex;
    std::vector<float> x, y, z;
    size_t count;
};

constexpr size_t PADDING = 16;

std::vector<Fan> fans(const Segments& segments) {
    std::vector<Fan> all;
    for (const Place& vertex : segments.vertices) {
        Fan fan{vertex.point, {}, {}, {}, 0};
        for (const Place& receiver : segments.receivers) {
            Vector way = receiver.point - vertex.point;
            if (dot(way, vertex.normal) <= 0 || dot(way, receiver.normal) >= 0) continue;
            fan.x.push_back(receiver.point.x);
            fan.y.push_back(receiver.point.y);
            fan.z.push_back(receiver.point.z);
        }
        fan.count = fan.x.size();
        size_t padded = (fan.count + PADDING - 1) / PADDING * PADDING;
        for (auto* axis : {&fan.x, &fan.y, &fan.z}) axis->resize(padded, axis->empty() ? 0 : axis->back());
        all.push_back(std::move(fan));
    }
    return all;
}

template <int N> void fill(Rays<N>& rays, const Fan& fan, size_t from) {
    for (int i = 0; i < N; i++) {
        size_t at = from + size_t(i);
        rays.x[i] = fan.apex.x;
        rays.y[i] = fan.apex.y;
        rays.z[i] = fan.apex.z;
        rays.near[i] = 0;
        rays.dx[i] = fan.x[at] - fan.apex.x;
        rays.dy[i] = fan.y[at] - fan.apex.y;
        rays.dz[i] = fan.z[at] - fan.apex.z;
        rays.time[i] = 0;
        rays.far[i] = 1;
        rays.mask[i] = ~0u;
        rays.id[i] = rays.flags[i] = 0;
    }
}

template <int N> size_t count_occluded(const Embree& embree, Handle scene, bool coherent, const std::vector<Fan>& all) {
    auto occluded = embree.occluded<N>(scene, coherent);
    size_t count = 0;
    alignas(64) int valid[N];
    Rays<N> rays;
    for (const Fan& fan : all) {
        for (size_t from = 0; from < fan.count; from += N) {
            fill<N>(rays, fan, from);
            int there = int(std::min(fan.count - from, size_t(N)));
            for (int i = 0; i < N; i++) valid[i] = i < there ? -1 : 0;
            occluded(valid, rays);
            int hits = 0;
            for (int i = 0; i < N; i++) hits += rays.far[i] < 0 ? 1 : 0;
            count += size_t(hits);
        }
    }
    return count;
}

template <int N>
void measure(const Embree& embree, Handle scene, const std::vector<Fan>& all, int repetitions,
             const std::string& label) {
    size_t rays = 0;
    for (const Fan& fan : all) rays += fan.count;
    for (bool coherent : {false, true}) {
        size_t count = 0;
        std::vector<double> rates;
        for (int i = 0; i < repetitions; i++) {
            double start = thread_seconds();
            count = count_occluded<N>(embree, scene, coherent, all);
            rates.push_back(double(rays) / (thread_seconds() - start) * 1e-6);
        }
        std::sort(rates.begin(), rates.end());
        double middle = (rates[(rates.size() - 1) / 2] + rates[rates.size() / 2]) / 2;
        std::printf("| %s | %d | %s | %.1f | %.1f | %zu of %zu |\n", label.c_str(), N, coherent ? "yes" : "no",
                    rates.back(), middle, count, rays);
        std::fflush(stdout);
    }
}

void run(const Embree& embree, int version, int repetitions, const std::string& path) {
    Segments segments = read(path);
    std::vector<Fan> all = fans(segments);
    for (Quality quality : {MEDIUM, HIGH}) {
        for (bool robust : {false, true}) {
            Handle scene = embree.build(segments, quality, robust);
            std::string label = std::to_string(version) + " | " + std::to_string(segments.corners.size() / 3) + " | " +
                                (quality == HIGH ? "high" : "medium") + " | " + (robust ? "yes" : "no");
            measure<1>(embree, scene, all, repetitions, label);
            measure<8>(embree, scene, all, repetitions, label);
            measure<16>(embree, scene, all, repetitions, label);
            embree.release(scene);
        }
    }
}

}  // namespace

int main(int argc, char** argv) try {
    if (argc < 5) throw std::runtime_error("usage: occlusion VERSION LIBRARY REPETITIONS SEGMENTS...");
    // As Embree's manual advises: no time is lost on denormal numbers.
    _mm_setcsr(_mm_getcsr() | 0x8040);
    Embree embree(std::atoi(argv[1]), argv[2]);
    for (int i = 4; i < argc; i++) run(embree, std::atoi(argv[1]), std::max(1, std::atoi(argv[3])), argv[i]);
} catch (const std::exception& error) {
    std::fprintf(stderr, "occlusion: %s\n", error.what());
    return 1;
}
