//! A data file that a page hands over: it is received into a folder of its own, which is removed with the view of it.

use super::serving::Refusal;
use crate::session::Session;
use crate::state::GivenFile;
use http_body_util::BodyExt;
use hyper::StatusCode;
use hyper::body::Incoming;
use organza::{Error, shown};
use std::fs::File;
use std::io::Write;
use std::time::Duration;
use tempfile::TempDir;
use tokio::time::timeout;

/// Time in which the next bytes of a file have to be there. All of them have to come while the socket is served.
const BYTES_TIME: Duration = Duration::from_secs(5);

/// Longest name of a file, bytes: systems allow 255, and a scene takes a name like it.
const LONGEST_NAME: usize = 200;

/// Characters that lead to other folders, or that some system allows in no name.
const NOT_IN_NAMES: [char; 9] = ['/', '\\', ':', '*', '?', '"', '<', '>', '|'];

/// Opens a data file.
type Open = Box<dyn Fn(GivenFile) -> Result<Session, Error> + Send + Sync>;

/// How a view opens data files that are dropped on its page.
pub struct Opener {
    pub(super) most_bytes: u64,
    pub(super) open: Open,
}

impl Opener {
    /// Opens files of `most_bytes` at most by `open`.
    pub fn new(most_bytes: u64, open: impl Fn(GivenFile) -> Result<Session, Error> + Send + Sync + 'static) -> Self {
        Self { most_bytes, open: Box::new(open) }
    }
}

/// A file that was received.
pub(super) struct Received {
    /// It is removed when this is dropped.
    pub(super) folder: TempDir,
    pub(super) file: GivenFile,
}

/// The name of a file as it stands in an address. It leads to no other folder.
///
/// # Errors
/// A refusal of what is no such name.
pub(super) fn file_name(text: &str) -> Result<String, Refusal> {
    let name = decoded(text).unwrap_or_default();
    let is_plain = |c: char| !c.is_control() && !NOT_IN_NAMES.contains(&c);
    let is_name = (1..=LONGEST_NAME).contains(&name.len()) && !name.starts_with('.') && name.chars().all(is_plain);
    let message = format!("`name`: expected the name of a file without folders, found `{}`", shown(&name));
    if is_name { Ok(name) } else { Err(Refusal::new(StatusCode::BAD_REQUEST, &message)) }
}

/// A text whose bytes may stand as `%` and two hexadecimal digits; `None` for what is no UTF-8 then.
fn decoded(text: &str) -> Option<String> {
    let mut parts = text.split('%');
    let mut bytes = parts.next()?.as_bytes().to_vec();
    for part in parts {
        let (digits, rest) = part.split_at_checked(2)?;
        bytes.push(u8::from_str_radix(digits, 16).ok()?);
        bytes.extend_from_slice(rest.as_bytes());
    }
    String::from_utf8(bytes).ok()
}

/// Refuses a file that is too large.
pub(super) fn check_size(bytes: u64, most_bytes: u64) -> Result<(), Refusal> {
    let message =
        format!("expected a file of at most {most_bytes} bytes, as much memory as this view may take (--max-memory)");
    if bytes <= most_bytes { Ok(()) } else { Err(Refusal::new(StatusCode::PAYLOAD_TOO_LARGE, &message)) }
}

/// Receives a file of this name.
///
/// # Errors
/// A refusal of a file that is too large or comes too slowly, and of a disk that is full.
pub(super) async fn receive(mut body: Incoming, name: String, most_bytes: u64) -> Result<Received, Refusal> {
    let unwritten = |e: std::io::Error| {
        Refusal::new(StatusCode::INSUFFICIENT_STORAGE, &format!("the file cannot be kept while it is open: {e}"))
    };
    let folder = tempfile::Builder::new().prefix("organza-view-").tempdir().map_err(unwritten)?;
    let path = folder.path().join(&name);
    let mut file = File::create_new(&path).map_err(unwritten)?;
    let mut received = 0;
    loop {
        let next = timeout(BYTES_TIME, body.frame()).await;
        let next = next.map_err(|_| Refusal::new(StatusCode::REQUEST_TIMEOUT, "the file comes too slowly"))?;
        let Some(frame) = next else { break };
        let frame = frame.map_err(|_| Refusal::new(StatusCode::BAD_REQUEST, "the file broke off"))?;
        // A frame without data has trailing headers, which say nothing of the file.
        let Ok(bytes) = frame.into_data() else { continue };
        received += bytes.len() as u64;
        check_size(received, most_bytes)?;
        file.write_all(&bytes).map_err(unwritten)?;
    }
    Ok(Received { folder, file: GivenFile { path, name } })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_nowhere_else() {
        for (text, name) in [("cloud.csv", "cloud.csv"), ("a%20b.ply", "a b.ply"), ("%C3%A4.nrrd", "ä.nrrd")] {
            assert_eq!(file_name(text).ok().as_deref(), Some(name));
        }
        let long = "a".repeat(LONGEST_NAME + 1);
        for text in [
            "",
            ".",
            "..",
            "../a.csv",
            "..%2Fa.csv",
            "%2Fetc%2Fpasswd",
            "a/b.csv",
            "a%5Cb.csv",
            "C:a.csv",
            ".bashrc",
            "a%00.csv",
            "a%0A.csv",
            "a%",
            "a%4",
            "a%zz",
            "%FF.csv",
            "a%2",
            "%+1.csv",
            &long,
        ] {
            assert!(file_name(text).is_err(), "{text}");
        }
    }
}
