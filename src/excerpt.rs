//! The line of a source text around a fault, with a caret under the place.

/// Characters of a line that are shown.
const WIDTH: usize = 100;

/// Where a fault is, and how that looks.
#[derive(Debug, Clone, PartialEq)]
pub struct Excerpt {
    /// Line, from 1.
    pub line: u32,
    /// Column in characters, from 1.
    pub column: u32,
    /// The line, or the part of a long one around the column, and the caret below it.
    pub text: String,
}

/// The excerpt of `source` around byte `place`.
pub fn excerpt(source: &str, place: usize) -> Excerpt {
    // A byte order mark is no column.
    let mark = source.len() - source.trim_start_matches('\u{feff}').len();
    let (source, place) = (&source[mark..], place.saturating_sub(mark));
    let before = source.get(..place).unwrap_or(source);
    let line = before.matches('\n').count();
    let column = before.rsplit('\n').next().unwrap_or("").chars().count();
    let text: Vec<char> = source.lines().nth(line).unwrap_or("").chars().collect();
    // Tabs stay tabs, so that the caret stands right.
    let from = column.saturating_sub(WIDTH / 2).min(text.len().saturating_sub(WIDTH));
    let shown = &text[from..text.len().min(from + WIDTH)];
    let indent: String =
        shown.iter().take(column - from).map(|c| if *c == '\t' { '\t' } else { ' ' }).collect();
    let text = format!("  {}\n  {indent}^", shown.iter().collect::<String>());
    Excerpt { line: line as u32 + 1, column: column as u32 + 1, text }
}
