//! The secret of a view's address.

use organza::Error;
use std::fmt::Write as _;

/// Random bytes of a token: 128 bits.
const BYTES: usize = 16;

/// A random word that whoever asks the server has to know.
#[derive(Clone)]
pub(crate) struct Token {
    text: String,
}

impl Token {
    /// A new one.
    ///
    /// # Errors
    /// [`Error::Internal`] where the system has no random numbers.
    pub(crate) fn new() -> Result<Self, Error> {
        let mut bytes = [0; BYTES];
        getrandom::fill(&mut bytes).map_err(|e| Error::Internal(format!("random numbers of the system: {e}")))?;
        let mut text = String::with_capacity(2 * BYTES);
        for byte in bytes {
            // Writing to a String cannot fail.
            let _ = write!(text, "{byte:02x}");
        }
        Ok(Self { text })
    }

    /// As it stands in the address.
    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    /// Whether a word is the token. It takes the same time wherever the first wrong letter stands.
    pub(crate) fn is(&self, word: &str) -> bool {
        let token = self.text.as_bytes();
        let word = word.as_bytes();
        if token.len() != word.len() {
            return false;
        }
        let difference = token.iter().zip(word).fold(0, |sum, (a, b)| sum | (a ^ b));
        std::hint::black_box(difference) == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_is_itself_alone() {
        let token = Token::new().unwrap();
        assert_eq!(token.text().len(), 32);
        assert!(token.is(token.text()));
        assert!(!token.is(Token::new().unwrap().text()));
        assert!(!token.is("") && !token.is(&token.text()[..31]) && !token.is(&format!("{}0", token.text())));
        let last = if token.text().ends_with('0') { "1" } else { "0" };
        assert!(!token.is(&format!("{}{last}", &token.text()[..31])));
    }
}
