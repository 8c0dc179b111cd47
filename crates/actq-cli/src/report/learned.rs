//! The table of calibration recordings.

use actq::data::Share;

use super::table::table;

/// Formats a row for every file, and a sum if there are several. Returns no text if all frames of one file are kept.
pub fn learned(shares: &[Share]) -> String {
    if shares.len() < 2 && shares.iter().all(|share| share.kept == share.frames) {
        return String::new();
    }
    let mut rows = table(&["learned from", "episodes", "frames", "kept"]);
    let mut line = |name: String, episodes: usize, frames: usize, kept: usize| {
        rows.add_row([name, episodes.to_string(), frames.to_string(), kept.to_string()]);
    };
    for Share { path, episodes, frames, kept } in shares {
        line(path.display().to_string(), *episodes, *frames, *kept);
    }
    if shares.len() > 1 {
        let sum = |of: fn(&Share) -> usize| shares.iter().map(of).sum::<usize>();
        line("sum".to_owned(), sum(|s| s.episodes), sum(|s| s.frames), sum(|s| s.kept));
    }
    format!("{rows}\n\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn share(path: &str, frames: usize, kept: usize) -> Share {
        Share { path: path.into(), episodes: 3, frames, kept }
    }

    #[test]
    fn a_single_whole_file_is_not_listed() {
        assert_eq!(learned(&[]), "");
        assert_eq!(learned(&[share("calib.npz", 20, 20)]), "");
        let one = learned(&[share("calib.npz", 20, 10)]);
        assert_eq!(one.trim_end().lines().count(), 2, "{one}");
        let text = learned(&[share("calib.npz", 20, 20), share("drives/a.npz", 100, 30)]);
        let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        let lines: Vec<Vec<String>> = text.lines().map(words).collect();
        assert_eq!(lines[2], ["drives/a.npz", "3", "100", "30"]);
        assert_eq!(lines[3], ["sum", "6", "120", "50"]);
    }
}
