//! The channels and the header of a luminance map.

use super::*;
use exr::prelude::{AnyChannels, AttributeValue, FlatSamples, Image, Layer, Text};

type Exr = Image<Layer<AnyChannels<FlatSamples>>>;

fn read_exr(path: &Path) -> Exr {
    exr::prelude::read_first_flat_layer_from_file(path).unwrap()
}

fn channel(image: &Exr, name: &str) -> Vec<f32> {
    let list = &image.layer_data.channel_data.list;
    let channel = list.iter().find(|c| c.name.eq(name)).unwrap_or_else(|| panic!("no channel {name}"));
    match &channel.sample_data {
        FlatSamples::F32(samples) => samples.clone(),
        _ => panic!("{name} is not 32-bit float"),
    }
}

#[test]
fn exr_channels_hold_value_error_interval_peak_and_direct() {
    let dir = written(&plan(JOB), &merged(20));
    let image = read_exr(&dir.path().join("view.exr"));
    let sorted = |i: &Exr| i.layer_data.channel_data.list.iter().map(|c| c.name.to_string()).collect::<Vec<_>>();
    assert_eq!(
        sorted(&image),
        [
            "B",
            "G",
            "R",
            "direct.Y",
            "luminance.Y",
            "luminance.ciLower",
            "luminance.ciUpper",
            "luminance.health",
            "luminance.peak",
            "luminance.standardError",
            "luminance.variance"
        ]
    );
    let y = channel(&image, "luminance.Y");
    // Row 0 is on top: the first three samples of the file are bins 0, 1, 2.
    assert_eq!(y, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    for grey in ["R", "G", "B"] {
        assert_eq!(channel(&image, grey), y);
    }
    let named = ["variance", "standardError", "ciLower", "ciUpper", "peak"];
    let read = named.map(|n| channel(&image, &format!("luminance.{n}")));
    for i in 0..6 {
        let mean = (i + 1) as f64;
        let expected = [0.01, 0.1, mean - 0.1 * T19, mean + 0.1 * T19, 5.0 / ((mean - 0.25) * 200.0)];
        for (name, (channel, expected)) in named.iter().zip(read.iter().zip(expected)) {
            assert!(close(channel[i], expected), "{name} of {i}: {} instead of {expected}", channel[i]);
        }
    }
    assert!(channel(&image, "direct.Y").iter().all(|&x| x == 0.25));
}

#[test]
fn exr_header_says_what_the_numbers_are() {
    let mut result = merged(20);
    result.missing = vec![4..8, 24..32];
    let dir = written(&plan(JOB), &result);
    let image = read_exr(&dir.path().join("eye.exr"));
    let layer = &image.layer_data;
    assert_eq!((layer.size.0, layer.size.1), (4, 2));
    assert_eq!(layer.encoding.compression, exr::prelude::Compression::ZIP16);
    assert_eq!(layer.encoding.blocks, exr::image::Blocks::ScanLines);
    assert_eq!(layer.encoding.line_order, exr::prelude::LineOrder::Increasing);
    assert_eq!(layer.attributes.white_luminance, Some(1.0));
    assert_eq!(image.attributes.chromaticities.unwrap().white.0, 0.3127);
    let attribute = |name: &str| &layer.attributes.other[&Text::from(name)];
    let expected = [
        ("units", "cd/m2"),
        ("estimate", "bounded"),
        ("batches", "20"),
        ("historiesPerBatch", "10"),
        ("histories", "200"),
        ("seed", "7"),
        ("planDigest", "abc123"),
        ("jobDigest", "d3"),
        ("inputDigests", "d1 r?om.glb; d2 room.bin"),
        ("programVersion", "0.1.0"),
        ("complete", "false"),
        ("missingBatches", "4-7, 24-31"),
    ];
    for (name, text) in expected {
        assert_eq!(attribute(name), &AttributeValue::Text(Text::from(text)), "{name}");
    }
    assert_eq!(attribute("confidence"), &AttributeValue::F64(0.95));
}

#[test]
fn exr_colours_are_the_means_of_r_g_b() {
    let job = JOB.replace("seed = 7", "seed = 7\nchannels = \"rgb\"");
    let mut result = merged(20);
    let mut bins = moments(6, 20, true);
    bins.colour[4] = [3.0, 2.0, 1.0];
    result.sets[0] = SetResult::Moments { bins: bins.into(), fixed_direct: vec![0.5; 6] };
    result.sets[1] = SetResult::Moments { bins: moments(8, 20, true).into(), fixed_direct: Vec::new() };
    let dir = written(&plan(&job), &result);
    let image = read_exr(&dir.path().join("view.exr"));
    assert_eq!(["R", "G", "B"].map(|c| channel(&image, c)[4]), [3.5, 2.5, 1.5]);
    assert_eq!(channel(&image, "luminance.Y")[4], 5.5);
    assert_eq!(channel(&image, "direct.Y")[4], 0.75);
}

#[test]
fn exr_of_one_batch_has_no_error_and_of_none_no_number() {
    for n in [0, 1] {
        let dir = written(&plan(JOB), &merged(n));
        let image = read_exr(&dir.path().join("view.exr"));
        assert!(close(channel(&image, "luminance.Y")[2], if n == 0 { f64::NAN } else { 3.0 }));
        for name in ["luminance.variance", "luminance.standardError", "luminance.ciLower", "luminance.ciUpper"] {
            assert!(channel(&image, name).iter().all(|x| x.is_nan()), "{name} of {n} batches");
        }
        assert_eq!(channel(&image, "luminance.peak")[0].is_nan(), n == 0);
    }
}

#[test]
fn exr_tells_no_information_from_exact_and_from_no_receiver() {
    let mut result = merged(20);
    let mut bins = moments(6, 20, false);
    // Never scored; known exactly; no receiver.
    for i in 0..3 {
        (bins.mean[i], bins.m2[i], bins.direct[i], bins.peak[i]) = (0.0, 0.0, 0.0, 0.0);
    }
    (bins.mean[1], bins.direct[1], bins.existed[1]) = (4.0, 4.0, 0);
    let fixed_direct = vec![0.0, 0.0, f64::NAN, 0.0, 0.0, 0.0];
    result.sets[0] = SetResult::Moments { bins: bins.into(), fixed_direct };
    let dir = written(&plan(JOB), &result);
    let image = read_exr(&dir.path().join("view.exr"));
    let get = |name: &str| channel(&image, name);
    assert_eq!(get("luminance.Y")[..2], [0.0, 4.0]);
    assert!(get("luminance.standardError")[0].is_nan() && get("luminance.ciUpper")[0].is_nan());
    assert_eq!((get("luminance.standardError")[1], get("luminance.ciUpper")[1]), (0.0, 4.0));
    assert!(get("luminance.peak")[1].is_nan());
    for c in &image.layer_data.channel_data.list {
        assert!(c.sample_data.value_by_flat_index(2).to_f32().is_nan(), "{}", c.name);
    }
    let set = &summary(dir.path())["sets"][0];
    assert_eq!([&set["no_information"], &set["exact"], &set["inside"]], [1, 1, 1]);
    assert_eq!(set["mean"], (0.0 + 4.0 + 4.0 + 5.0 + 6.0) / 5.0);
    assert_eq!((set["min"].as_f64(), set["max"].as_f64()), (Some(0.0), Some(6.0)));
    assert!(close(set["worst_relative_error"].as_f64().unwrap(), 0.1 / 4.0));
}
