//! scratch
#[path = "../../tests/common/scenes.rs"]
#[allow(dead_code)]
mod scenes;
use lampyris::farm::pilot::bounds;
use lampyris::farm::realization::Realization;
use lampyris::job::Job;
use lampyris::math::{DVec3, PI};
use lampyris::scene::Scene;
use lampyris::tally::statistics::{Estimate, student_quantile};
use rayon::prelude::*;

fn main() {
    let arg: Vec<String> = std::env::args().collect();
    let reps: u64 = arg[1].parse().unwrap();
    let h: u64 = arg[2].parse().unwrap();
    let batches: u64 = arg[3].parse().unwrap();
    for bounded in [true, false] {
        let mut text =
            format!("scene=\"x\"\n[run]\nhistories_per_batch={h}\nbatches={batches}\n[transport]\nbounded={bounded}\n");
        let ss = [0.3, 0.1, 0.03, 0.01, 0.003, 0.001, 0.0003];
        for (i, s) in ss.iter().enumerate() {
            text += &scenes::point(&format!("p{i}"), [*s, 0.0, 0.5], [0.0, 1.0, 0.0]);
        }
        text += "[[camera]]\nname=\"edge\"\neye=[0.05,0.5,0.5]\ntarget=[0.05,0,0.5]\nup=[1,0,0]\nvertical_fov_degrees=11.421186274999286\nwidth=1\nheight=1\npixel_samples=1\n";
        let model = || scenes::closed_box(DVec3::ONE, &scenes::lambert(0.5, 1.0 / PI));
        let job = Job::parse(&text, "t").unwrap();
        let scene = Scene::new(model(), &job).unwrap();
        let b = bounds(&job, &scene);
        println!("bounded {bounded}: b {b:?}");
        let t = student_quantile(0.95, batches);
        let start = std::time::Instant::now();
        let all: Vec<Vec<(Estimate, Estimate)>> = (0..reps)
            .into_par_iter()
            .map(|seed| {
                let mut job = job.clone();
                job.run.seed = seed + 1;
                let r = Realization::new(&job, &scene, &b);
                let scores: Vec<_> = (0..batches).map(|i| r.batch(i)).collect();
                (0..job.sets().len())
                    .map(|set| {
                        let v = |k: usize| scores[k].sets[set].value[0];
                        let d = |k: usize| scores[k].sets[set].direct[0];
                        (
                            Estimate::from_scores((0..batches as usize).map(|k| v(k) - d(k))),
                            Estimate::from_scores((0..batches as usize).map(v)),
                        )
                    })
                    .collect()
            })
            .collect();
        println!("{:.1} s", start.elapsed().as_secs_f64());
        for set in 0..8 {
            let (truth, name) =
                if set == 0 { (0.5 / PI, "pixel".to_owned()) } else { (1.0, format!("s={}", ss[set - 1])) };
            let of = |f: &dyn Fn(&(Estimate, Estimate)) -> Estimate, truth: f64| {
                let e: Vec<Estimate> = all.iter().map(|r| f(&r[set])).collect();
                let covered =
                    e.iter().filter(|e| (e.mean - truth).abs() <= t * e.standard_error).count() as f64 / reps as f64;
                let m = Estimate::from_scores(e.iter().map(|e| e.mean / truth));
                let sd = m.standard_error * (reps as f64).sqrt() * ((h * batches) as f64).sqrt();
                format!("cov {covered:.4} mean {:.5}({:.5}) sd/hist {sd:.3}", m.mean, m.standard_error)
            };
            println!(
                "{name:10} ind: {} | total: {}",
                of(&|r| r.0, truth),
                of(&|r| r.1, if set == 0 { 1.0 / PI } else { 2.0 })
            );
        }
    }
}
