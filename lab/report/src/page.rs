//! Pages that open without a network: the report of the paper, the page of a log, the study of false alarms.

use maud::{DOCTYPE, Markup, PreEscaped, html};

/// By this a page is recognised as one of this program, which it may write over.
pub const GENERATOR: &str = r#"<meta name="generator" content="Two-Step sitl">"#;

/// Style of every page: dark on white, tables that line up, figures as wide as the text.
const STYLE: &str = include_str!("page/style.css");

/// A whole page; `style` stands behind the style of every page.
pub fn page(title: &str, style: &str, body: &Markup) -> String {
    page_with_head(title, style, &html! {}, body)
}

/// The same with more in its head.
pub fn page_with_head(title: &str, style: &str, head: &Markup, body: &Markup) -> String {
    let page = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                (PreEscaped(GENERATOR))
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                (head)
                style { (PreEscaped(STYLE)) (PreEscaped(style)) }
            }
            body { (body) }
        }
    };
    page.into_string()
}

/// Markdown with headings, paragraphs and tables, as a part of a page.
pub fn markdown(text: &str) -> Markup {
    let cells = |line: &str| -> Vec<String> {
        let line = line.trim().trim_start_matches('|').trim_end_matches('|');
        line.split('|').map(|cell| cell.trim().to_owned()).collect()
    };
    html! {
        @for block in text.split("\n\n").map(str::trim) {
            @let mut lines = block.lines();
            @if let Some(title) = block.strip_prefix("## ") { h2 { (title) } }
            @else if !block.starts_with('|') { p { (block) } }
            @else {
                table.study {
                    thead { tr { @for cell in lines.next().map(cells).unwrap_or_default() { th { (cell) } } } }
                    // The next line rules off the heading.
                    @for line in lines.skip(1) { tr.first { @for cell in cells(line) { td { (cell) } } } }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_and_paragraphs_of_markdown_are_those_of_a_page() {
        let html = markdown(
            "## Laws\n\nOf 3 < 4.\n\n| law | lost |\n|---|---|\n| a | 1 |\n| b | |\n\nEnd.\n",
        )
        .into_string();
        assert_eq!(
            html,
            "<h2>Laws</h2><p>Of 3 &lt; 4.</p><table class=\"study\"><thead><tr><th>law</th><th>lost</th></tr></thead>\
             <tr class=\"first\"><td>a</td><td>1</td></tr><tr class=\"first\"><td>b</td><td></td></tr></table><p>End.</p>"
        );
    }
}
