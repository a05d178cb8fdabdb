//! How often each mark is set where intervals hold and where they do not, and what other thresholds would do.

use super::count::Counted;
use lampyris::tally::health::{Mark, Signs, VOV_BATCHES};

/// Prints the shares of the marks case by case, and those of other thresholds over all.
pub fn print(counted: &[Counted]) {
    println!("\n| case | quantity | {} |", Mark::ALL.map(Mark::word).join(" | "));
    println!("|---|---|{}", "---|".repeat(Mark::ALL.len()));
    for c in counted {
        let shares = Mark::ALL.map(|mark| format!("{:.1} %", 100.0 * c.share_of(mark)));
        println!("| {} | {} | {} |", c.case, c.quantity.name, shares.join(" | "));
    }
    thresholds(counted);
}

/// Shares of replicates over thresholds: in quantities whose coverage holds, and in those whose coverage does not.
fn thresholds(counted: &[Counted]) {
    type Sign = fn(&Signs) -> f64;
    let signs: [(&str, Sign, [f64; 5]); 4] = [
        ("relative error", |s| s.relative_error, [0.02, 0.05, 0.1, 0.15, 0.2]),
        ("peak", |s| s.peak, [0.01, 0.02, 0.05, 0.1, 0.2]),
        (
            "vov, from 50 batches",
            |s| if s.batches >= VOV_BATCHES { s.vov } else { f64::NAN },
            [0.05, 0.1, 0.15, 0.2, 0.3],
        ),
        ("vov of histories", |s| s.history_vov, [0.01, 0.02, 0.05, 0.1, 0.2]),
    ];
    println!(
        "\n| sign | threshold | set where coverage holds | set where it does not | coverage where not set (those that fail) |"
    );
    println!("|---|---|---|---|---|");
    for (name, sign, limits) in signs {
        for limit in limits {
            let over = |s: &Signs| sign(s) > limit;
            let (holds, fails): (Vec<&Counted>, Vec<&Counted>) = counted.iter().partition(|c| c.coverage_holds());
            println!(
                "| {name} | {limit} | {} | {} | {} |",
                share(&holds, over),
                share(&fails, over),
                unset(&fails, over)
            );
        }
    }
}

fn share(counted: &[&Counted], over: impl Fn(&Signs) -> bool) -> String {
    let all = || counted.iter().flat_map(|c| &c.readings);
    let set = all().filter(|r| r.signs.iter().any(&over)).count();
    percent(set, all().count())
}

/// Coverage of the readings on which the sign is not over its limit.
fn unset(counted: &[&Counted], over: impl Fn(&Signs) -> bool) -> String {
    let readings = counted.iter().flat_map(|c| c.readings.iter().map(move |r| (c, r)));
    let left: Vec<_> = readings.filter(|(_, r)| !r.signs.iter().any(&over)).collect();
    let covered = left.iter().filter(|(c, r)| c.covers(r)).count();
    format!("{} of {}", percent(covered, left.len()), left.len())
}

fn percent(part: usize, whole: usize) -> String {
    if whole == 0 { "-".to_owned() } else { format!("{:.1} %", 100.0 * part as f64 / whole as f64) }
}
