//! Coverage of intervals, measured: how often an interval of the program contains the truth, over many seeds.
//!
//! ```text
//! cargo run --release --example coverage -- edge SAMPLING KERNEL REPLICATES      lux-meters and a pixel at an edge
//! cargo run --release --example coverage -- cases REPLICATES                     small cases of every kind
//! cargo run --release --example coverage -- lights [CASE] REPLICATES             many lights, lights with an extent
//! cargo run --release --example coverage -- surfaces REPLICATES                  opal, panes, mirrors, glass, tables, textures
//! cargo run --release --example coverage -- convergence SAMPLING SEEDS           no floor beside a column
//! ```
//!
//! SAMPLING is rqmc, random or thinned, KERNEL bounded or plain, CASE points, areas, opening, openings, mesh, spheres or window. Tables go to the terminal as Markdown; docs/coverage.md holds a
//! record.

mod cases;
mod convergence;
mod count;
mod edge;
mod lights;
mod marks;
mod replicate;
mod surfaces;

use count::Counted;
use lampyris::error::{Error, Result};

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let start = std::time::Instant::now();
    if let Err(error) = run(&words.iter().map(String::as_str).collect::<Vec<_>>()) {
        eprintln!("{error}");
        std::process::exit(2);
    }
    eprintln!("{:.0} s", start.elapsed().as_secs_f64());
}

fn run(words: &[&str]) -> Result<()> {
    let names = lights::CASES.map(|(name, _)| name);
    let allowed = format!(
        "edge SAMPLING KERNEL REPLICATES, cases REPLICATES, lights [{}] REPLICATES, surfaces REPLICATES, convergence SAMPLING SEEDS",
        names.join("|")
    );
    let last = words.last().and_then(|w| w.parse::<u64>().ok()).filter(|&n| n > 1);
    match (words, last) {
        (["edge", sampling, kernel @ ("bounded" | "plain"), _], Some(n)) => {
            let counted = edge::run(sampling, *kernel == "bounded", n)?;
            println!("{}", Counted::HEAD);
            print(&counted);
            marks::print(&counted);
            Ok(())
        }
        (["cases", _], Some(n)) => {
            println!("{}", Counted::HEAD);
            marks::print(&cases::run(n, print)?);
            Ok(())
        }
        (["lights", only @ .., _], Some(n)) if only.iter().all(|name| names.contains(name)) && only.len() < 2 => {
            println!("{}", Counted::HEAD);
            marks::print(&lights::run(only.first().copied(), n, print)?);
            Ok(())
        }
        (["surfaces", _], Some(n)) => {
            println!("{}", Counted::HEAD);
            marks::print(&surfaces::run(n, print)?);
            Ok(())
        }
        (["convergence", sampling, _], Some(n)) => convergence::run(sampling, n),
        _ => Err(Error::input("coverage", "arguments", words.join(" "), allowed)),
    }
}

fn print(counted: &[Counted]) {
    counted.iter().for_each(|c| println!("{}", c.row()));
}
