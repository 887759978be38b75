//! Breaks long lines.

const WIDTH: usize = 120;

/// Where a line may break, better places first: before these, or behind a comma.
const BREAKS: &[&[&str]] = &[&[" && ", " || "], &[", "], &[" + ", " - "], &[" * ", " / "], &[" | "]];

/// Breaks lines that are too long at the outermost operators or commas, as long as it finds any.
pub(super) fn wrap(text: &str) -> String {
    text.lines().flat_map(|line| [wrap_line(line), "\n".to_owned()]).collect()
}

/// Places at a depth of parentheses where the line may break.
fn places(line: &str, depth: usize, at: &[&str]) -> Vec<usize> {
    let mut places = Vec::new();
    let mut open = 0;
    for (index, character) in line.char_indices() {
        match character {
            '(' | '[' | '{' => open += 1,
            ')' | ']' | '}' => open -= 1,
            _ => {}
        }
        if open == depth as i32
            && let Some(found) = at.iter().find(|found| line[index..].starts_with(**found))
            && !line[index..].starts_with(", access::")
        {
            // Commas end a line, operators begin one.
            places.push(if *found == ", " { index + 1 } else { index });
        }
    }
    places
}

fn wrap_line(line: &str) -> String {
    let is_text = line.trim_start().starts_with("//") || line.starts_with('#') || line.trim_start().starts_with('"');
    if line.len() <= WIDTH || is_text {
        return line.to_owned();
    }
    let indent = line.len() - line.trim_start().len() + 4;
    let candidates = (0..4).flat_map(|depth| BREAKS.iter().map(move |at| places(line, depth, at)));
    for places in candidates {
        if let Some(text) = filled(line, &places, indent) {
            return text;
        }
    }
    line.to_owned()
}

/// The line broken at some of `places` so that all parts fit, if they do.
fn filled(line: &str, places: &[usize], indent: usize) -> Option<String> {
    let mut parts = Vec::new();
    let mut begin = 0;
    while begin < line.len() {
        let limit = if begin == 0 { WIDTH } else { begin + WIDTH - indent + 1 };
        if line.len() <= limit {
            parts.push(&line[begin..]);
            break;
        }
        let end = places.iter().copied().rfind(|&place| place > begin && place <= limit)?;
        parts.push(&line[begin..end]);
        begin = end;
    }
    let separator = format!("\n{}", " ".repeat(indent));
    Some(
        parts
            .iter()
            .enumerate()
            .map(|(i, part)| if i == 0 { part.trim_end() } else { part.trim() })
            .collect::<Vec<_>>()
            .join(&separator),
    )
}
