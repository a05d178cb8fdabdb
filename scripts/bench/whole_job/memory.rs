//! State per bin and per triangle, against the element map of direct simulation.

use super::large;
use super::maps::{plan, tally};
use lampyris::job::Job;
use lampyris::scene::{Scene, gltf};
use lampyris::tally::SetTally;

/// What a map keeps of a bin, the same for an element of direct simulation \[bytes\].
fn bytes_of_bin(channels: &str) -> f64 {
    let plan = plan(channels, 1);
    let SetTally::Moments(moments) = &tally(&plan, 0).sets[0] else { panic!("the job has a map") };
    let b = &moments.bins;
    let columns = [&b.mean, &b.m2, &b.direct, &b.peak, &b.caustic].map(|c| size_of_val(&c[..]));
    let all = columns.iter().sum::<usize>() + size_of_val(&b.existed[..]) + size_of_val(&b.colour[..]);
    all as f64 / b.len() as f64
}

/// Prints the table.
pub fn bench() {
    for channels in ["luminance", "rgb"] {
        println!("{channels}: {} bytes a bin", bytes_of_bin(channels));
    }
    let (bytes, triangles) = large::glb();
    let model = gltf::load("bench", &bytes, &mut |uri| panic!("{uri}: the scene is one file"));
    let job = "[[source]]\nkind = \"omni\"\nposition = [3.0, 2.6, 2.0]\nintensity = 79.577\n[[point]]\nname = \"p\"\n\
        position = [3.0, 2.0, 2.0]\nnormal = [0.0, 1.0, 0.0]\n";
    let job = Job::parse(job, "bench").expect("the job is right");
    let scene = Scene::new(model.expect("the scene is right"), &job).expect("the scene is right");
    let area: f64 = (0..scene.primitives()).map(|p| scene.geometry.area(p)).sum();
    println!(
        "{triangles} triangles: {:.0} bytes a triangle, surface {area:.1} m2",
        scene.bytes() as f64 / triangles as f64
    );
    println!("element map, an element a triangle: {:.0} MB", triangles as f64 * bytes_of_bin("luminance") / 1e6);
    for millimetres in [100.0, 10.0, 1.0f64] {
        let elements = area / (millimetres * millimetres * 1e-6);
        let megabytes = elements * bytes_of_bin("luminance") / 1e6;
        println!("element map, elements of {millimetres} mm: {megabytes:.1} MB");
    }
}
