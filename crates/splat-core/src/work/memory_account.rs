//! Who takes how much memory, counted before it is allocated.

use crate::Exceeded;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What to do about a refusal.
const HINT: &str = "raise the memory limit (--max-memory), or thin out the data";

/// Bytes from which on the system is asked whether it has them too, when they are taken from an account.
const ASKED: u64 = 1 << 20;

/// One account of memory that all who allocate from untrusted sizes draw on, each before it allocates.
///
/// Clones are the same account. [`part`](Self::part) gives an account for one piece of work: its bytes count here too, and all
/// of them come back when the last clone of the part is dropped. [`up_to`](Self::up_to) gives the same account another limit.
///
/// ```
/// use splat_core::MemoryAccount;
/// let account = MemoryAccount::new(100);
/// let held = account.take("an image", 60)?;
/// assert!(account.take("another image", 60).is_err());
/// drop(held);
/// assert_eq!((account.used(), account.peak()), (0, 60));
/// # Ok::<(), splat_core::Exceeded>(())
/// ```
#[derive(Debug, Clone)]
pub struct MemoryAccount {
    limit: u64,
    tally: Arc<Tally>,
}

/// Bytes of an account or of a part of one.
#[derive(Debug, Default)]
struct Tally {
    state: Mutex<State>,
    /// The tally that this one is a part of.
    whole: Option<Arc<Tally>>,
}

#[derive(Debug, Default)]
struct State {
    used: u64,
    peak: u64,
    /// What is held by name, until the tally ends.
    named: Vec<(String, u64)>,
}

/// Bytes that are taken from an account until this is dropped.
#[derive(Debug)]
pub struct Reservation {
    account: MemoryAccount,
    bytes: u64,
}

impl MemoryAccount {
    /// An account of so many bytes.
    pub fn new(limit: u64) -> Self {
        Self { limit, tally: Arc::default() }
    }

    /// Bytes that may be taken, all together.
    pub fn limit(&self) -> u64 {
        self.limit
    }

    /// The same account with another limit.
    pub fn up_to(&self, limit: u64) -> Self {
        Self { limit, tally: self.tally.clone() }
    }

    /// An account for one piece of work, under the same limit: what it takes counts here until it ends.
    pub fn part(&self) -> Self {
        let tally = Tally { state: Mutex::default(), whole: Some(self.tally.clone()) };
        Self { limit: self.limit, tally: Arc::new(tally) }
    }

    /// Bytes that are taken now by all who share the account.
    pub fn used(&self) -> u64 {
        self.tally.root().state().used
    }

    /// Most bytes that were taken at a time.
    pub fn peak(&self) -> u64 {
        self.tally.root().state().peak
    }

    /// Bytes that may still be taken.
    pub fn left(&self) -> u64 {
        self.limit.saturating_sub(self.used())
    }

    /// Takes bytes until the reservation is dropped.
    ///
    /// # Errors
    /// [`Exceeded`] where the account has fewer left, or the system; nothing is taken then.
    pub fn take(&self, what: &str, bytes: u64) -> Result<Reservation, Exceeded> {
        self.tally.add(what, bytes, self.limit)?;
        Ok(Reservation { account: self.clone(), bytes })
    }

    /// Says how many bytes `what` takes by now; they are taken until this part of the account ends, or fewer are said.
    ///
    /// # Errors
    /// [`Exceeded`] where the account has not as many left; `what` then takes as many as before.
    pub fn hold(&self, what: &str, bytes: u64) -> Result<(), Exceeded> {
        let before = self.tally.state().named.iter().find(|named| named.0 == what).map_or(0, |named| named.1);
        if bytes > before {
            self.tally.add(what, bytes - before, self.limit)?;
        } else {
            self.tally.give_back(before - bytes);
        }
        let mut state = self.tally.state();
        match state.named.iter_mut().find(|named| named.0 == what) {
            Some(named) => named.1 = bytes,
            None => state.named.push((what.to_owned(), bytes)),
        }
        Ok(())
    }
}

impl Default for MemoryAccount {
    /// 4 GiB.
    fn default() -> Self {
        Self::new(4 << 30)
    }
}

/// Accounts of one limit treat the same data alike.
impl PartialEq for MemoryAccount {
    fn eq(&self, other: &Self) -> bool {
        self.limit == other.limit
    }
}

impl Eq for MemoryAccount {}

impl Tally {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn root(&self) -> &Self {
        self.whole.as_deref().map_or(self, Self::root)
    }

    /// Adds bytes to this tally and to all that it is a part of, of which the outermost decides.
    fn add(&self, what: &str, bytes: u64, limit: u64) -> Result<(), Exceeded> {
        if let Some(whole) = &self.whole {
            whole.add(what, bytes, limit)?;
        }
        let mut state = self.state();
        if self.whole.is_none() && bytes > limit.saturating_sub(state.used) {
            let used = state.used;
            let beside = if used > 0 { format!(" beside the {used} that are taken") } else { String::new() };
            let what = format!("{what}{beside}").into();
            let limit = Some(limit);
            return Err(Exceeded { what, needed: bytes, limit, unit: "bytes", hint: HINT.into() });
        }
        if self.whole.is_none() {
            ask_system(what, bytes)?;
        }
        state.used = state.used.saturating_add(bytes);
        state.peak = state.peak.max(state.used);
        Ok(())
    }

    fn give_back(&self, bytes: u64) {
        let mut state = self.state();
        state.used = state.used.saturating_sub(bytes);
        drop(state);
        if let Some(whole) = &self.whole {
            whole.give_back(bytes);
        }
    }
}

/// Refuses what the system has no room for now: whoever is to allocate it in pieces might be the one that ends the process otherwise.
fn ask_system(what: &str, bytes: u64) -> Result<(), Exceeded> {
    let mut room: Vec<u8> = Vec::new();
    let has_room = bytes < ASKED || usize::try_from(bytes).is_ok_and(|bytes| room.try_reserve_exact(bytes).is_ok());
    // Else a compiler may see that nobody uses the room, and ask for none.
    std::hint::black_box(&mut room);
    let hint = "free memory, or thin out the data".into();
    let refused = || Exceeded { what: what.to_owned().into(), needed: bytes, limit: None, unit: "bytes", hint };
    if has_room { Ok(()) } else { Err(refused()) }
}

impl Drop for Tally {
    fn drop(&mut self) {
        let left = self.state().used;
        if let Some(whole) = &self.whole {
            whole.give_back(left);
        }
    }
}

impl Reservation {
    /// Bytes that it holds.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Holds so many bytes from now on.
    ///
    /// # Errors
    /// [`Exceeded`] where the account has not as many left; it then holds as many as before.
    pub fn set(&mut self, what: &str, bytes: u64) -> Result<(), Exceeded> {
        if bytes > self.bytes {
            self.account.tally.add(what, bytes - self.bytes, self.account.limit)?;
        } else {
            self.account.tally.give_back(self.bytes - bytes);
        }
        self.bytes = bytes;
        Ok(())
    }
}

impl Drop for Reservation {
    fn drop(&mut self) {
        self.account.tally.give_back(self.bytes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_who_share_an_account_draw_on_it_and_give_back() {
        let account = MemoryAccount::new(100);
        let mut first = account.take("a", 40).unwrap();
        let part = account.part();
        let second = part.take("b", 30).unwrap();
        part.hold("c", 20).unwrap();
        assert_eq!((account.used(), account.left(), part.left()), (90, 10, 10));
        let refused = account.take("d", 11).unwrap_err();
        assert_eq!(refused.to_string(), "d beside the 90 that are taken needs 11 bytes, the limit is 100 bytes");
        assert_eq!(first.set("a", 51).unwrap_err().needed, 11);
        first.set("a", 50).unwrap();
        assert_eq!(account.left(), 0);
        drop(second);
        part.hold("c", 45).unwrap();
        assert_eq!(part.hold("c", 51).unwrap_err().needed, 6);
        part.hold("c", 5).unwrap();
        assert_eq!(account.used(), 55);
        drop(part);
        assert_eq!(account.used(), 50);
        drop(first);
        assert_eq!((account.used(), account.peak()), (0, 100));
    }

    #[test]
    fn a_part_holds_its_bytes_as_long_as_anything_of_it_is_there() {
        let account = MemoryAccount::new(10);
        let held = account.part().take("a", 6).unwrap();
        assert_eq!(account.used(), 6);
        // Another limit, the same bytes.
        assert!(account.up_to(5).take("b", 0).is_ok() && account.up_to(5).take("b", 1).is_err());
        assert!(account.up_to(20).take("b", 14).is_ok());
        drop(held);
        assert_eq!(account.used(), 0);
    }

    #[test]
    fn threads_never_take_more_than_there_is() {
        let account = MemoryAccount::new(1000);
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    for k in 0..2000 {
                        drop(account.take("a", k % 300));
                    }
                });
            }
        });
        assert!(account.peak() <= 1000 && account.used() == 0, "{account:?}");
    }
}
