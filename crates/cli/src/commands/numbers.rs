//! Numbers on the command line that have a range.

/// Threads or pieces of work at a time: more than any machine has would only wait for one another.
pub fn jobs(text: &str) -> Result<usize, String> {
    const MOST: usize = 1024;
    let jobs = text.parse().ok().filter(|jobs| *jobs <= MOST);
    jobs.ok_or_else(|| format!("expected 0 to {MOST}"))
}

/// Frames per second.
pub fn rate_hz(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok();
    let rate = rate.filter(|rate| (1.0..=1000.0).contains(rate));
    rate.ok_or_else(|| "expected 1 to 1000 frames per second".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_outside_their_ranges_are_refused() {
        assert_eq!(jobs("0"), Ok(0));
        assert_eq!(rate_hz("59.94"), Ok(59.94));
        for text in ["1000000", "-1", "x", "1.5"] {
            jobs(text).unwrap_err();
        }
        for text in ["0", "-1", "NaN", "inf", "1e300", "0.5", "x", ""] {
            rate_hz(text).unwrap_err();
        }
    }
}
