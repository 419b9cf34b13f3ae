//! The guide, which is compiled into the program: its pages in the order of the summary, as blocks
//! of text.

use std::sync::LazyLock;

use pulldown_cmark::{CodeBlockKind, Event, HeadingLevel, Options, Parser, Tag, TagEnd};

/// A page of the guide.
pub struct Page {
    pub title: String,
    /// Its file, by which other pages link to it.
    pub file: &'static str,
    pub blocks: Vec<Block>,
}

/// A part of a page that stands by itself.
#[derive(Clone, Debug, PartialEq)]
pub enum Block {
    /// From 1 on.
    Heading(usize, Vec<Span>),
    Text(Vec<Span>),
    /// How deep it is indented, its number or mark, and what it says.
    Item(usize, String, Vec<Span>),
    Code(String),
    /// Row by row; the first one is the head.
    Table(Vec<Vec<Vec<Span>>>),
}

/// Text of one look.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Span {
    pub text: String,
    pub is_strong: bool,
    pub is_code: bool,
    /// Where it leads.
    pub link: Option<String>,
}

/// What of the guide is seen.
#[derive(Default)]
pub struct GuideView {
    pub page: usize,
    pub search: String,
    /// The first block that has what is searched for is to be scrolled to.
    pub follow: bool,
    /// The page is new: it is seen from its top.
    pub is_new: bool,
}

impl GuideView {
    pub fn turn(&mut self, page: usize) {
        self.page = page;
        self.is_new = true;
        self.follow = !self.search.trim().is_empty();
    }
}

macro_rules! texts {
    ($($file:literal)*) => { &[$(($file, include_str!(concat!("../../assets/guide/", $file)))),*] };
}

const TEXTS: &[(&str, &str)] = texts! {
    "introduction.md" "words.md" "walk.md" "building.md" "photograph.md" "brackets.md" "import.md"
    "modelling.md" "capture.md" "tag.md" "masks.md" "known-lights.md" "reconstruct.md" "inspect.md" "pin.md"
    "relight.md" "export.md" "studies.md" "troubleshooting.md" "commands.md" "options.md" "keys.md"
    "files.md" "fields.md" "messages.md" "trust.md" "method.md" "validation.md" "tuning.md" "tried.md"
    "speed.md" "sources.md"
};

/// All pages; read once, which takes a few milliseconds.
pub fn pages() -> &'static [Page] {
    static PAGES: LazyLock<Vec<Page>> = LazyLock::new(|| {
        let page = |&(file, text): &(&'static str, &str)| {
            let blocks = blocks(text);
            let title = blocks.iter().find_map(|block| match block {
                Block::Heading(1, spans) => Some(plain(spans)),
                _ => None,
            });
            Page { title: title.unwrap_or_else(|| file.to_owned()), file, blocks }
        };
        TEXTS.iter().map(page).collect()
    });
    &PAGES
}

/// The page that a link within the guide leads to, by its index.
pub fn linked(link: &str) -> Option<usize> {
    let file = link.split('#').next().unwrap_or(link);
    pages().iter().position(|page| page.file == file)
}

impl Block {
    /// Whether it has a text, in small letters, in it.
    pub fn has(&self, wanted: &str) -> bool {
        let spans = |spans: &[Span]| plain(spans).to_lowercase().contains(wanted);
        match self {
            Self::Heading(_, own) | Self::Text(own) | Self::Item(_, _, own) => spans(own),
            Self::Code(text) => text.to_lowercase().contains(wanted),
            Self::Table(rows) => rows.iter().flatten().any(|cell| spans(cell)),
        }
    }
}

/// The text without its looks.
pub fn plain(spans: &[Span]) -> String {
    spans.iter().map(|span| span.text.as_str()).collect()
}

fn blocks(text: &str) -> Vec<Block> {
    let mut reader = Reader::default();
    for event in Parser::new_ext(text, Options::ENABLE_TABLES) {
        reader.take(event);
    }
    reader.end();
    reader.blocks
}

#[derive(Default)]
struct Reader {
    blocks: Vec<Block>,
    /// Of the block that is being read.
    spans: Vec<Span>,
    heading: usize,
    code: Option<String>,
    /// The next number of each list that is open; without one its items have a dot.
    lists: Vec<Option<u64>>,
    /// The mark of an item whose text has not begun.
    mark: Option<String>,
    rows: Vec<Vec<Vec<Span>>>,
    look: Span,
}

impl Reader {
    fn take(&mut self, event: Event) {
        match event {
            Event::Start(tag) => self.start(tag),
            Event::End(tag) => self.stop(tag),
            Event::Text(text) => match &mut self.code {
                Some(code) => code.push_str(&text),
                None => self.push(&text, false),
            },
            Event::Code(text) => self.push(&text, true),
            Event::SoftBreak | Event::HardBreak => self.push(" ", false),
            _ => {}
        }
    }

    fn push(&mut self, text: &str, is_code: bool) {
        self.spans.push(Span { text: text.to_owned(), is_code, ..self.look.clone() });
    }

    fn start(&mut self, tag: Tag) {
        match tag {
            Tag::Heading { level, .. } => {
                self.heading = match level {
                    HeadingLevel::H1 => 1,
                    HeadingLevel::H2 => 2,
                    _ => 3,
                };
            }
            Tag::CodeBlock(CodeBlockKind::Fenced(_) | CodeBlockKind::Indented) => {
                self.end();
                self.code = Some(String::new());
            }
            Tag::List(first) => {
                self.end();
                self.lists.push(first);
            }
            Tag::Item => {
                self.mark = Some(match self.lists.last_mut() {
                    Some(Some(number)) => {
                        *number += 1;
                        format!("{}.", *number - 1)
                    }
                    _ => "•".to_owned(),
                });
            }
            Tag::Table(_) => self.rows.clear(),
            Tag::TableHead | Tag::TableRow => self.rows.push(Vec::new()),
            Tag::Strong | Tag::Emphasis => self.look.is_strong = true,
            Tag::Link { dest_url, .. } => self.look.link = Some(dest_url.into_string()),
            Tag::Image { .. } => self.push("Picture: ", false),
            _ => {}
        }
    }

    fn stop(&mut self, tag: TagEnd) {
        match tag {
            TagEnd::CodeBlock => {
                let code = self.code.take().unwrap_or_default();
                self.blocks.push(Block::Code(code.trim_end().to_owned()));
            }
            TagEnd::Paragraph | TagEnd::Heading(_) | TagEnd::Item => self.end(),
            TagEnd::List(_) => {
                self.end();
                self.lists.pop();
            }
            TagEnd::TableCell => {
                let cell = std::mem::take(&mut self.spans);
                if let Some(row) = self.rows.last_mut() {
                    row.push(cell);
                }
            }
            TagEnd::Table => self.blocks.push(Block::Table(std::mem::take(&mut self.rows))),
            TagEnd::Strong | TagEnd::Emphasis => self.look.is_strong = false,
            TagEnd::Link => self.look.link = None,
            _ => {}
        }
    }

    /// What was read so far is a block.
    fn end(&mut self) {
        let spans = std::mem::take(&mut self.spans);
        let heading = std::mem::take(&mut self.heading);
        if spans.is_empty() {
            return;
        }
        let depth = self.lists.len();
        self.blocks.push(match self.mark.take() {
            _ if heading > 0 => Block::Heading(heading, spans),
            Some(mark) => Block::Item(depth, mark, spans),
            None if depth > 0 => Block::Item(depth, String::new(), spans),
            None => Block::Text(spans),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_page_of_the_summary_is_there_in_its_order() {
        let summary = include_str!("../../assets/guide/SUMMARY.md");
        let listed: Vec<&str> =
            summary.split("](").skip(1).filter_map(|rest| rest.split(')').next()).collect();
        let own: Vec<&str> = pages().iter().map(|page| page.file).collect();
        assert_eq!(own, listed);
        for page in pages() {
            assert!(page.title != page.file && page.blocks.len() > 2, "{}", page.file);
        }
    }

    #[test]
    fn links_between_pages_lead_somewhere() {
        let links = |spans: &[Span]| -> Vec<String> {
            spans.iter().filter_map(|span| span.link.clone()).collect()
        };
        for page in pages() {
            let all = page.blocks.iter().flat_map(|block| match block {
                Block::Heading(_, own) | Block::Text(own) | Block::Item(_, _, own) => links(own),
                Block::Table(rows) => rows.iter().flatten().flat_map(|cell| links(cell)).collect(),
                Block::Code(_) => Vec::new(),
            });
            for link in all.filter(|link| link.split('#').next().unwrap_or("").ends_with(".md")) {
                let is_outside = link.starts_with("http") || link.starts_with("..");
                assert!(is_outside || linked(&link).is_some(), "{}: {link}", page.file);
            }
        }
    }

    #[test]
    fn blocks_keep_what_stands_in_them() {
        let text = "# A *b*\n\nOne `two`\nthree [four](tag.md).\n\n1. x\n   - y\n2. z\n\n\
                    | h | i |\n|---|---|\n| 1 | **2** |\n\n```sh\nrun it\n```\n";
        let read = blocks(text);
        let kinds: Vec<String> = read
            .iter()
            .map(|block| match block {
                Block::Heading(level, own) => format!("{level} {}", plain(own)),
                Block::Text(own) => plain(own),
                Block::Item(depth, mark, own) => format!("{depth} {mark} {}", plain(own)),
                Block::Code(text) => text.clone(),
                Block::Table(rows) => format!("{} rows of {}", rows.len(), rows[0].len()),
            })
            .collect();
        assert_eq!(
            kinds,
            ["1 A b", "One two three four.", "1 1. x", "2 • y", "1 2. z", "2 rows of 2", "run it"]
        );
        let Block::Text(spans) = &read[1] else { panic!("a text") };
        assert!(spans[1].is_code && spans[4].link.as_deref() == Some("tag.md"), "{spans:?}");
        assert!(read[5].has("2") && read[6].has("run") && !read[1].has("run"));
    }
}
