//! What the user is told: once each, in short, and never more than a screen of it.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Time after which the same may be told again, and after which it may be where it was over in between.
const AGAIN: Duration = Duration::from_secs(60);
const AGAIN_IF_OVER: Duration = Duration::from_secs(1);

/// Kinds of messages that are remembered.
const KINDS_MAX: usize = 64;

/// Messages that wait to be fetched.
const WAITING_MAX: usize = 32;

/// Longest text that is taken over from the service, characters.
const FOREIGN_MAX: usize = 160;

/// Messages on their way to the user.
#[derive(Debug, Default)]
pub(super) struct Messages {
    waiting: VecDeque<String>,
    told: Vec<Told>,
}

/// A kind of message that was told.
#[derive(Debug)]
struct Told {
    kind: String,
    at: Instant,
    is_over: bool,
}

impl Messages {
    /// Tells a text, unless one of the same kind was told within a minute.
    pub(super) fn say(&mut self, kind: &str, now: Instant, text: impl FnOnce() -> String) {
        self.told.retain(|told| {
            let rest = if told.is_over { AGAIN_IF_OVER } else { AGAIN };
            now.saturating_duration_since(told.at) < rest
        });
        if self.told.iter().any(|told| told.kind == kind) {
            return;
        }
        if self.waiting.len() >= WAITING_MAX || self.told.len() >= KINDS_MAX {
            return;
        }
        self.told.push(Told {
            kind: kind.to_owned(),
            at: now,
            is_over: false,
        });
        self.waiting.push_back(text());
    }

    /// What this kind told is over: it may be told again soon.
    pub(super) fn end(&mut self, kind: &str) {
        for told in &mut self.told {
            told.is_over |= told.kind == kind;
        }
    }

    /// The oldest that waits.
    pub(super) fn next(&mut self) -> Option<String> {
        self.waiting.pop_front()
    }
}

/// A text of the service as it may stand in a message: one line, not long, printable.
pub(super) fn plain(text: &str) -> String {
    let line: String = text
        .chars()
        .map(|c| if c.is_control() { ' ' } else { c })
        .take(FOREIGN_MAX)
        .collect();
    line.trim().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn same_kind_is_told_once_a_minute_or_soon_after_it_was_over() {
        let mut messages = Messages::default();
        let begun = Instant::now();
        let mut say = |after_ms: u64, text: &str, is_over: bool| {
            let now = begun + Duration::from_millis(after_ms);
            messages.say("brake", now, || text.to_owned());
            if is_over {
                messages.end("brake");
            }
            messages.next()
        };
        assert_eq!(say(0, "a", false).as_deref(), Some("a"));
        assert_eq!(say(59_900, "b", false), None);
        assert_eq!(say(60_100, "c", true).as_deref(), Some("c"));
        assert_eq!(say(61_000, "d", true), None);
        assert_eq!(say(61_200, "e", false).as_deref(), Some("e"));
        assert_eq!(say(63_000, "f", false), None);
        messages.say("stall", begun, || "another".to_owned());
        assert_eq!(messages.next().as_deref(), Some("another"));
    }

    #[test]
    fn flood_of_kinds_is_bounded() {
        let mut messages = Messages::default();
        let now = Instant::now();
        for n in 0..10_000 {
            messages.say(&n.to_string(), now, || "text".to_owned());
        }
        assert_eq!(messages.waiting.len(), WAITING_MAX);
        assert!(messages.told.len() <= KINDS_MAX);
    }

    #[test]
    fn foreign_text_is_one_short_printable_line() {
        assert_eq!(plain("a\n\u{1b}[31mb "), "a  [31mb");
        assert_eq!(plain(&"x".repeat(1000)).len(), FOREIGN_MAX);
    }
}
