//! The clients of a session: at most two pages.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Most pages that share a session.
pub(crate) const MOST_CLIENTS: usize = 2;

/// A page that has asked nothing for so long makes room for another; one that is open asks every 20 s.
const SILENCE: Duration = Duration::from_secs(45);

/// A view is over so long after its last page was closed: a page that is loaded anew is back before.
const CLOSED: Duration = Duration::from_secs(20);

/// The same where the last page fell silent without a word: phones and notebooks that sleep may wake again.
const ASLEEP: Duration = Duration::from_secs(600);

/// Most names that are remembered of pages that were closed.
const MOST_LEFT: usize = 64;

/// Most characters of the word that a page calls itself by.
const LONGEST_NAME: usize = 64;

/// A page.
#[derive(Debug)]
struct Client {
    name: String,
    seen: Instant,
}

/// The pages that look at a session.
#[derive(Debug, Default)]
pub(crate) struct Clients {
    clients: Vec<Client>,
    /// Names of the last pages that said that they are closed: what they still asked on their way out brings none of them back.
    left: VecDeque<String>,
    /// When the view is over, where there is no page after the first.
    over_at: Option<Instant>,
}

/// Whether a page may look.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Admission {
    /// It may.
    Welcome,
    /// It does not call itself by a word of letters and digits.
    Nameless,
    /// There are as many as may be.
    Full,
    /// It has said that it is closed.
    Left,
}

impl Clients {
    /// A page asks something.
    pub(crate) fn admit(&mut self, name: &str, now: Instant) -> Admission {
        let is_word = !name.is_empty() && name.len() <= LONGEST_NAME && name.bytes().all(|b| b.is_ascii_alphanumeric());
        if !is_word {
            return Admission::Nameless;
        }
        if self.left.iter().any(|left| left == name) {
            return Admission::Left;
        }
        self.forget(now);
        if let Some(client) = self.clients.iter_mut().find(|client| client.name == name) {
            client.seen = now;
            return Admission::Welcome;
        }
        if self.clients.len() >= MOST_CLIENTS {
            return Admission::Full;
        }
        self.clients.push(Client { name: name.to_owned(), seen: now });
        self.over_at = None;
        Admission::Welcome
    }

    /// A page says that it is closed.
    pub(crate) fn leave(&mut self, name: &str, now: Instant) {
        if self.clients.iter().any(|client| client.name == name) {
            self.left.push_back(name.to_owned());
            if self.left.len() > MOST_LEFT {
                self.left.pop_front();
            }
        }
        self.keep(now + CLOSED, |client| client.name != name);
    }

    /// Whether all pages have been gone for long, after the first.
    pub(crate) fn are_gone(&mut self, now: Instant) -> bool {
        self.forget(now);
        self.over_at.is_some_and(|end| now >= end)
    }

    fn forget(&mut self, now: Instant) {
        self.keep(now + ASLEEP, |client| now.saturating_duration_since(client.seen) < SILENCE);
    }

    /// Keeps the pages that are there; without any the view is over at `end`.
    fn keep(&mut self, end: Instant, is_there: impl Fn(&Client) -> bool) {
        let before = self.clients.len();
        self.clients.retain(is_there);
        if before > 0 && self.clients.is_empty() {
            self.over_at = Some(end);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_third_page_waits_until_one_is_gone() {
        let start = Instant::now();
        let mut clients = Clients::default();
        assert_eq!([clients.admit("a", start), clients.admit("b", start)], [Admission::Welcome; 2]);
        assert_eq!([clients.admit("c", start), clients.admit("a", start)], [Admission::Full, Admission::Welcome]);
        clients.leave("b", start);
        assert_eq!(clients.admit("c", start), Admission::Welcome);
        // Without a word for long they make room.
        assert_eq!([clients.admit("d", start + SILENCE), clients.admit("e", start + SILENCE)], [Admission::Welcome; 2]);
    }

    #[test]
    fn a_view_is_over_some_time_after_its_last_page() {
        let start = Instant::now();
        let mut clients = Clients::default();
        assert!(!clients.are_gone(start + 2 * ASLEEP), "there was no page yet");
        clients.admit("a", start);
        clients.leave("a", start);
        assert!(!clients.are_gone(start + CLOSED / 2) && clients.are_gone(start + CLOSED));
        clients.admit("b", start + CLOSED);
        assert!(!clients.are_gone(start + CLOSED));
        let silent = start + CLOSED + SILENCE;
        assert!(!clients.are_gone(silent) && !clients.are_gone(silent + CLOSED) && clients.are_gone(silent + ASLEEP));
    }

    #[test]
    fn what_a_page_asked_on_its_way_out_does_not_bring_it_back() {
        let start = Instant::now();
        let mut clients = Clients::default();
        clients.admit("a", start);
        clients.leave("a", start);
        assert_eq!(clients.admit("a", start), Admission::Left);
        assert!(clients.are_gone(start + CLOSED));
        // Names are forgotten in the end, and so is whoever was never there.
        for rank in 0..=MOST_LEFT {
            let name = format!("b{rank}");
            clients.leave(&name, start);
            assert_eq!(clients.admit(&name, start), Admission::Welcome);
            clients.leave(&name, start);
        }
        assert_eq!(clients.left.len(), MOST_LEFT);
    }

    #[test]
    fn names_are_short_words() {
        let mut clients = Clients::default();
        let long = "a".repeat(LONGEST_NAME + 1);
        for name in ["", "a b", "ä", "../a", &long] {
            assert_eq!(clients.admit(name, Instant::now()), Admission::Nameless, "{name}");
        }
    }
}
