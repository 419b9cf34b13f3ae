//! The messages of the window: errors that stay until they are dismissed, notices that disappear
//! after a while, and the log of both.

use std::time::{Duration, Instant};

const NOTICE: Duration = Duration::from_secs(6);
const LONGEST_LOG: usize = 5000;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    Info,
    Warning,
    Error,
}

#[derive(Clone, Debug)]
pub struct Line {
    /// Since the window opened.
    pub secs: f64,
    pub level: Level,
    pub text: String,
}

#[derive(Clone, Debug)]
pub struct ErrorCard {
    pub title: String,
    /// The worker's own text, as the terminal prints it.
    pub text: String,
}

pub struct Messages {
    began: Instant,
    pub errors: Vec<ErrorCard>,
    pub notices: Vec<(Instant, String)>,
    pub log: Vec<Line>,
}

impl Default for Messages {
    fn default() -> Self {
        Self { began: Instant::now(), errors: Vec::new(), notices: Vec::new(), log: Vec::new() }
    }
}

impl Messages {
    pub fn error(&mut self, title: impl Into<String>, text: impl Into<String>) {
        let card = ErrorCard { title: title.into(), text: text.into() };
        self.line(Level::Error, format!("{}: {}", card.title, card.text));
        self.errors.push(card);
    }

    pub fn notice(&mut self, text: impl Into<String>) {
        let text = text.into();
        self.line(Level::Info, text.clone());
        self.notices.push((Instant::now(), text));
    }

    pub fn info(&mut self, text: impl Into<String>) {
        self.line(Level::Info, text.into());
    }

    pub fn warning(&mut self, text: impl Into<String>) {
        self.line(Level::Warning, text.into());
    }

    fn line(&mut self, level: Level, text: String) {
        // What the worker reports it logs itself.
        match level {
            Level::Error => log::error!("{text}"),
            Level::Warning | Level::Info => log::debug!("{text}"),
        }
        if self.log.len() >= LONGEST_LOG {
            self.log.drain(..LONGEST_LOG / 10);
        }
        self.log.push(Line { secs: self.began.elapsed().as_secs_f64(), level, text });
    }

    /// Lets notices go that were shown long enough; the time until the next has to.
    pub fn expire(&mut self) -> Option<Duration> {
        self.notices.retain(|(at, _)| at.elapsed() < NOTICE);
        self.notices.iter().map(|(at, _)| NOTICE.saturating_sub(at.elapsed())).min()
    }
}
