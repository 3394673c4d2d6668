//! A scene on a page of the browser: it is turned, its objects and effects are changed, and every change is drawn again.
//!
//! ```text
//! page ─ events ─► session ─► state ─► scene ─► artist ─► picture, coarse, then whole ─► page
//! (src/page)       (session)  (state)            (artist)  (picture)
//!        └─ server, serving: HTTP on the loopback, one token, two clients ─┘
//! ```
//!
//! Only `server` and `serving` know a network, and no module knows a window: a [`Session`] takes [`Event`]s and returns pictures. The last
//! picture of each state has the bits of [`organza::render`] of the same scene.
//!
//! ```
//! use organza::RenderOptions;
//! use organza_view::{Event, Opening, Session};
//! let text = br#"
//!     version = 1
//!     [camera]
//!     position = [0, 0, 4]
//!     target = [0, 0, 0]
//!     size = [32, 32]
//!     [[object]]
//!     name = "fog"
//!     medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 0.5, spacing = 0.1 }
//! "#;
//! let opening = Opening::of_text("fog.toml", text, RenderOptions::default());
//! let session = Session::open(opening, &organza::Progress::new()).unwrap();
//! session.apply(&[Event::Orbit { right: 0.25, up: 0.0 }]).unwrap();
//! let picture = session.whole_picture().unwrap();
//! assert_eq!(picture.facts.size.width, 32);
//! assert!(picture.png.starts_with(b"\x89PNG"));
//! ```
#![forbid(unsafe_code)]

mod accuracy;
mod artist;
mod coarse;
mod curve;
mod depths;
mod desk;
mod event;
mod layer_image;
mod lights;
mod picture;
mod recording;
mod replay;
mod scene_text;
mod server;
mod session;
mod state;
mod viewpoint;
mod watch;
mod wording;

pub use accuracy::RungRow;
pub use accuracy::compare::{Comparison, KeptRow};
pub use curve::{CurveRow, Values};
pub use depths::PicturePlace;
pub use depths::below::{Below, FilePlace, NamedValue};
pub use event::{Cut, Event, Knot, MOST_CUTS, MOST_KNOTS, Switch};
pub use lights::{Direction, LightRow};
pub use picture::{EffectRow, Facts, Legend, Level, Mark, PassRow, Picture, Size};
pub use recording::{MOST_EVENTS, Recording};
pub use replay::EventFile;
pub use server::{Ended, Framing, Opener, Server};
pub use session::{Failure, ObjectRow, Opened, Session, Shown, ShownAccuracy, ShownBox};
pub use state::{GivenFile, Opening};
pub use viewpoint::Viewpoint;
pub use watch::Watch;

/// The page's example compiles and holds.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Page;
