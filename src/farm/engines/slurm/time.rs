//! Time limits as Slurm writes them: minutes, minutes:seconds, hours:minutes:seconds, days-hours, days-hours:minutes,
//! days-hours:minutes:seconds.

/// Longest warning before the limit \[s\].
const WARNING: u64 = 120;

/// How long a job may run \[s\].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeLimit(pub u64);

impl TimeLimit {
    /// So many hours.
    pub const fn hours(hours: u64) -> Self {
        TimeLimit(3600 * hours)
    }

    /// How long before the limit Slurm is asked for a signal \[s\]: two minutes, or a third of a short limit. Slurm may
    /// send it up to a minute earlier.
    pub fn warning(&self) -> u64 {
        WARNING.min(self.0 / 3)
    }
}

impl std::str::FromStr for TimeLimit {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let allowed = || "allowed: Slurm's forms from one minute to a year, such as 90, 1:30:00 or 2-12".to_owned();
        let seconds = seconds(text).filter(|s| (60..=366 * 86400).contains(s)).ok_or_else(allowed)?;
        Ok(TimeLimit(seconds))
    }
}

impl std::fmt::Display for TimeLimit {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let (hours, rest) = (self.0 / 3600, self.0 % 3600);
        write!(f, "{}-{:02}:{:02}:{:02}", hours / 24, hours % 24, rest / 60, rest % 60)
    }
}

fn seconds(text: &str) -> Option<u64> {
    let (days, rest) = match text.split_once('-') {
        Some((days, rest)) => (Some(number(days)?), rest),
        None => (None, text),
    };
    let parts: Vec<u64> = rest.split(':').map(number).collect::<Option<_>>()?;
    let time = |h: u64, m: u64, s: u64| 3600 * h + 60 * m + s;
    match (days, parts[..].as_ref()) {
        (None, [m]) => Some(time(0, *m, 0)),
        (None, [m, s]) => Some(time(0, *m, *s)),
        (None, [h, m, s]) => Some(time(*h, *m, *s)),
        (Some(d), [h]) => Some(time(24 * d + h, 0, 0)),
        (Some(d), [h, m]) => Some(time(24 * d + h, *m, 0)),
        (Some(d), [h, m, s]) => Some(time(24 * d + h, *m, *s)),
        _ => None,
    }
}

/// A number of digits only, small enough that nothing overflows.
fn number(text: &str) -> Option<u64> {
    let plain = (1..=7).contains(&text.len()) && text.bytes().all(|b| b.is_ascii_digit());
    text.parse().ok().filter(|_| plain)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slurms_forms_are_read_and_others_refused() {
        let read = |text: &str| text.parse::<TimeLimit>().ok().map(|t| (t.0, t.warning()));
        for (text, seconds, warning) in [
            ("1", 60, 20),
            ("90", 5400, 120),
            ("4:30", 270, 90),
            ("1:30:00", 5400, 120),
            ("2-12", 216_000, 120),
            ("1-0:30", 88_200, 120),
            ("1-1:1:1", 90_061, 120),
        ] {
            assert_eq!(read(text), Some((seconds, warning)), "{text}");
            assert_eq!(read(&TimeLimit(seconds).to_string()), Some((seconds, warning)), "{text}");
        }
        for text in
            ["", "0", "0:59", "-1", "1-", "1:2:3:4", "1h", "UNLIMITED", "99999999", "1-2:3:4:5", " 5", "9999999"]
        {
            assert_eq!(read(text), None, "{text}");
        }
    }
}
