//! Pages that open without a network: the report of the paper, the page of a log, the study of false alarms.

use maud::{DOCTYPE, Markup, PreEscaped, html};

/// By this a page is recognised as one of this program, which it may write over.
pub const GENERATOR: &str = r#"<meta name="generator" content="Two-Step sitl">"#;

/// Style of every page: dark on white, tables that line up, figures as wide as the text.
const STYLE: &str = include_str!("page/style.css");

/// A whole page; `style` stands behind the style of every page.
#[must_use]
pub fn page(title: &str, style: &str, body: &Markup) -> String {
    page_with_head(title, style, &html! {}, body)
}

/// The same with more in its head.
#[must_use]
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
