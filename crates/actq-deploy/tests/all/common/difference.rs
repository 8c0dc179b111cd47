//! Differences of texts by lines.

/// Returns the lines that only one of two texts has, the first one's after "-" and the second one's after "+".
pub(crate) fn difference(first: &[String], second: &[String]) -> String {
    // Lengths of the longest common sequences of the texts' ends.
    let mut common = vec![vec![0usize; second.len() + 1]; first.len() + 1];
    for i in (0..first.len()).rev() {
        for j in (0..second.len()).rev() {
            let equal = first[i] == second[j];
            common[i][j] = if equal { common[i + 1][j + 1] + 1 } else { common[i + 1][j].max(common[i][j + 1]) };
        }
    }
    let (mut i, mut j, mut lines) = (0, 0, Vec::new());
    while i < first.len() || j < second.len() {
        if i < first.len() && j < second.len() && first[i] == second[j] {
            (i, j) = (i + 1, j + 1);
        } else if j == second.len() || (i < first.len() && common[i + 1][j] >= common[i][j + 1]) {
            lines.push(format!("- {}", first[i]));
            i += 1;
        } else {
            lines.push(format!("+ {}", second[j]));
            j += 1;
        }
    }
    if lines.is_empty() { "nothing else".to_owned() } else { lines.join("\n") }
}
