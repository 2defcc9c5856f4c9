//! Text in a given number of columns.

use unicode_width::{UnicodeWidthChar, UnicodeWidthStr};

/// Between two fields.
const GAP: &str = "   ";

/// The columns that a text takes on a terminal.
pub(super) fn columns(text: &str) -> usize {
    text.width()
}

/// The text in at most `width` columns, with a sign where it was cut. What would move the cursor is left out.
pub(super) fn cut(text: &str, width: usize) -> String {
    let shown: String = text.chars().filter(|c| !c.is_control()).collect();
    if columns(&shown) <= width {
        return shown;
    }
    let (mut short, mut used) = (String::new(), 1);
    for c in shown.chars() {
        used += c.width().unwrap_or(0);
        if used > width {
            break;
        }
        short.push(c);
    }
    if width > 0 {
        short.push('~');
    }
    short
}

/// Fields behind a name. Those that do not fit go on in lines below, indented as deep as the name is long; where the
/// screen is too narrow for that, by two columns.
pub(super) fn fields(name: &str, fields: &[String], width: usize) -> Vec<String> {
    let widest = fields.iter().map(|field| columns(field.trim_end())).max().unwrap_or(0);
    let is_narrow = columns(name) + widest > width;
    let (mut lines, mut line, mut is_empty) = (Vec::new(), name.to_owned(), true);
    let indent = if is_narrow { "  ".to_owned() } else { " ".repeat(columns(name)) };
    if is_narrow && !name.trim().is_empty() {
        lines.push(cut(name.trim_end(), width));
        line.clone_from(&indent);
    }
    for field in fields {
        let gap = if is_empty { "" } else { GAP };
        if !is_empty && columns(&line) + gap.len() + columns(field.trim_end()) > width {
            lines.push(cut(line.trim_end(), width));
            line.clone_from(&indent);
        } else {
            line.push_str(gap);
        }
        line.push_str(field);
        is_empty = false;
    }
    lines.push(cut(line.trim_end(), width));
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_fits_stays_and_what_does_not_ends_with_a_sign() {
        assert_eq!(cut("altitude", 8), "altitude");
        assert_eq!(cut("altitude", 7), "altitu~");
        assert_eq!(cut("altitude", 1), "~");
        assert_eq!(cut("altitude", 0), "");
        assert_eq!(cut("a\x1b[2Jb\r\n", 10), "a[2Jb", "nothing moves the cursor");
        assert_eq!(
            cut("\u{98db}\u{884c}\u{6a5f}", 5),
            "\u{98db}\u{884c}~",
            "wide letters take two columns"
        );
    }

    #[test]
    fn fields_go_on_below_their_first() {
        let values = ["roll 10".to_owned(), "pitch 20".to_owned()];
        assert_eq!(fields("left  ", &values, 24), ["left  roll 10   pitch 20"]);
        assert_eq!(fields("left  ", &values, 23), ["left  roll 10", "      pitch 20"]);
        assert_eq!(fields("left  ", &values, 12), ["left", "  roll 10", "  pitch 20"]);
        assert_eq!(fields("left  ", &values, 8), ["left", "  roll ~", "  pitch~"]);
    }
}
