//! Millions of lines against star-shaped objects: first hits by the program and by the oracle of its tests.
//!
//!     cargo run --release --example harmonic_rays -- [LINES] [SERIES.harmonic]
//!
//! Prints for each object how many lines were wrong, which must be none, how many started inside and met nothing, which must be
//! none, and how many disagree where an extremum lies within 1e-10 of zero, where nobody can tell.

#[path = "../../tests/harmonic/lines.rs"]
mod lines;
#[path = "../../tests/harmonic/objects.rs"]
mod objects;
#[path = "../../tests/harmonic/oracle.rs"]
mod oracle;

use lampyris::geometry::harmonic::{Series, Star, file};
use lampyris::random::{Domain, Generator, Stream};
use lines::Verdict;
use rayon::prelude::*;
use std::error::Error;
use std::time::Instant;

/// Lines with one generator.
const TOGETHER: usize = 1000;

fn generator(name: &str, number: usize) -> Generator {
    Stream::new(23, Domain::Trajectory, name).generator(number as u64)
}

/// Wrong, leaking and grazing lines of [`TOGETHER`].
fn count(name: &str, star: &Star, number: usize) -> [usize; 3] {
    let mut rng = generator(name, number);
    let mut counts = [0; 3];
    for _ in 0..TOGETHER {
        let (o, d) = lines::draw(star, &mut rng);
        match lines::judge(star, o, d) {
            Verdict::Agrees { leaves } => counts[1] += usize::from(leaves),
            Verdict::Grazes => counts[2] += 1,
            Verdict::Wrong(why) => {
                counts[0] += 1;
                println!("{name}: {why} from {o} along {d}");
            }
        }
    }
    counts
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let all: usize = arguments.next().unwrap_or("1000000".into()).parse()?;
    let head = arguments.next().unwrap_or(concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/head.harmonic").into());
    let objects = [
        ("sphere", Series::constant(0.7)),
        ("reference", objects::reference()),
        ("ellipsoid", objects::ellipsoid()),
        ("rough", objects::rough(32, &mut generator("rough", 0))),
        ("head", file::File::parse(&head, &std::fs::read(&head)?)?.series),
    ];
    let mut bad = 0;
    println!("object      lines  wrong  leaking  grazing  seconds");
    for (name, series) in objects {
        let star = Star::new(series)?;
        let start = Instant::now();
        let [wrong, leaking, grazing] = (0..all.div_ceil(TOGETHER))
            .into_par_iter()
            .map(|number| count(name, &star, number))
            .reduce(|| [0; 3], |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]]);
        println!("{name:9} {all:8} {wrong:6} {leaking:8} {grazing:8} {:8.0}", start.elapsed().as_secs_f64());
        bad += wrong + leaking;
    }
    if bad == 0 { Ok(()) } else { Err(format!("{bad} lines are wrong or leak").into()) }
}
