//! Requests and their responses: routes, and the checks of clients.

use super::Framing;
use super::clients::{Admission, Clients, MOST_CLIENTS};
use super::token::Token;
use super::upload::{Opener, Received, check_size, file_name, receive};
use crate::accuracy::compare::Comparison;
use crate::depths::PicturePlace;
use crate::event::Event;
use crate::session::{Drawing, Failure, Session, Shown};
use crate::state::GivenFile;
use crate::wording::{self, Said};
use http_body_util::{BodyExt, Full, LengthLimitError, Limited};
use hyper::body::{Body, Bytes, Incoming};
use hyper::header::{self, HeaderMap, HeaderName, HeaderValue};
use hyper::{Method, Request, Response, StatusCode};
use organza::Error;
use organza::output::Format;
use serde::Serialize;
use serde_json::json;
use std::net::{IpAddr, SocketAddr};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use tokio::sync::Semaphore;
use tokio::time::timeout;

/// Most bytes of a request's body: events of a drag are a few hundred.
const MOST_BODY_BYTES: usize = 64 << 10;

/// Time in which a request's body has to be there.
const BODY_TIME: Duration = Duration::from_secs(5);

/// How long a request waits for news, at most; while something is drawn, so long for the next word of its progress.
const PATIENCE: Duration = Duration::from_secs(20);
const PATIENCE_WHILE_DRAWING: Duration = Duration::from_millis(250);

/// Time that a file has for its first picture before it takes the place of the view before, picture or not: a socket is served for a while only.
const FIRST_PICTURE: Duration = Duration::from_secs(20);

/// The one policy: script, style and pictures of this server alone, and no other page around this one.
const POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; \
                      base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// The same with pages of this machine around it.
const POLICY_OF_THIS_MACHINE: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
                                      connect-src 'self'; base-uri 'none'; form-action 'none'; \
                                      frame-ancestors http://localhost:* http://127.0.0.1:* http://[::1]:*";

const PAGE: &str = include_str!("../page/page.html");
const SCRIPT: &str = include_str!("../page/page.js");
const CURVE: &str = include_str!("../page/curve.js");
const CUT: &str = include_str!("../page/cut.js");
const JUDGE: &str = include_str!("../page/judge.js");
const OVERLAY: &str = include_str!("../page/overlay.js");
const OPEN: &str = include_str!("../page/open.js");
const SAVE: &str = include_str!("../page/save.js");
const STYLE: &str = include_str!("../page/page.css");

/// The state behind all responses.
pub(crate) struct Counter {
    pub(crate) current: Mutex<Current>,
    pub(crate) clients: Mutex<Clients>,
    pub(crate) token: Token,
    pub(crate) address: SocketAddr,
    pub(crate) framing: Framing,
    pub(crate) opener: Option<Opener>,
    /// Of whoever opens a file: one at a time.
    pub(crate) turn: Semaphore,
}

impl Counter {
    pub(crate) fn current(&self) -> MutexGuard<'_, Current> {
        // It is changed by single statements.
        self.current.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn session(&self) -> Arc<Session> {
        Arc::clone(&self.current().session)
    }
}

/// The session that pages see, and the folders of files that they handed over, which are removed when these are dropped.
pub(crate) struct Current {
    session: Arc<Session>,
    folder: Option<TempDir>,
    next: Option<Arriving>,
}

/// A file that is being opened.
struct Arriving {
    folder: TempDir,
    /// The session that is to show it; `None` before it is read.
    session: Option<Arc<Session>>,
}

impl Current {
    pub(crate) const fn new(session: Arc<Session>) -> Self {
        Self { session, folder: None, next: None }
    }

    /// Ends the session, and removes what pages handed over.
    pub(crate) fn end(&mut self) {
        self.session.close();
        self.folder = None;
        let arriving = self.next.take().and_then(|next| next.session);
        arriving.iter().for_each(|session| session.close());
    }
}

/// The state as pages get it.
#[derive(Serialize)]
struct Told<'s> {
    #[serde(flatten)]
    shown: &'s Shown,
    /// Most bytes of a file that a page may hand over; `None` where the view opens none.
    most_file_bytes: Option<u64>,
    /// The first picture of a file that is being opened.
    opening: Option<Drawing>,
}

type Answer = Response<Full<Bytes>>;

/// Answers a request, or says why not.
pub(crate) async fn answer(counter: &Arc<Counter>, request: Request<Incoming>) -> Answer {
    let mut answer = answered(counter, request).await.unwrap_or_else(Refusal::answer);
    let headers = answer.headers_mut();
    let policy = if counter.framing == Framing::Nobody { POLICY } else { POLICY_OF_THIS_MACHINE };
    for (name, value) in [
        (header::CONTENT_SECURITY_POLICY, policy),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CACHE_CONTROL, "no-store"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    ] {
        headers.insert(name, HeaderValue::from_static(value));
    }
    answer
}

/// Why a request is not answered.
pub(super) struct Refusal {
    status: StatusCode,
    message: String,
    hint: String,
}

impl Refusal {
    pub(super) fn new(status: StatusCode, message: &str) -> Self {
        Self { status, message: message.to_owned(), hint: String::new() }
    }

    /// The response to an error of a scene.
    fn of_error(error: &Error) -> Self {
        let status = match error {
            Error::Internal(_) => StatusCode::INTERNAL_SERVER_ERROR,
            _ => StatusCode::UNPROCESSABLE_ENTITY,
        };
        let Said { message, hint } = wording::said(error);
        Self { status, message, hint }
    }

    fn answer(self) -> Answer {
        let document = json!({ "message": self.message, "hint": self.hint });
        let mut answer = of_type("application/json", document.to_string());
        *answer.status_mut() = self.status;
        answer
    }
}

fn of_type(content: &'static str, body: impl Into<Bytes>) -> Answer {
    let mut answer = Response::new(Full::new(body.into()));
    answer.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(content));
    answer
}

/// The requested route, behind the token.
enum Route<'p> {
    Page,
    Script(&'static str),
    Style,
    State,
    Picture,
    Events,
    Centre,
    Below,
    Accuracy,
    Keep,
    LetGo,
    Kept,
    Comparison,
    Difference,
    Leave,
    Open,
    Save(&'p str),
}

impl<'p> Route<'p> {
    fn from_path(path: &'p str) -> Option<Self> {
        Some(match path {
            "" => Self::Page,
            "page.js" => Self::Script(SCRIPT),
            "curve.js" => Self::Script(CURVE),
            "cut.js" => Self::Script(CUT),
            "judge.js" => Self::Script(JUDGE),
            "overlay.js" => Self::Script(OVERLAY),
            "open.js" => Self::Script(OPEN),
            "save.js" => Self::Script(SAVE),
            "page.css" => Self::Style,
            "state" => Self::State,
            "picture" => Self::Picture,
            "events" => Self::Events,
            "centre" => Self::Centre,
            "below" => Self::Below,
            "accuracy" => Self::Accuracy,
            "keep" => Self::Keep,
            "let-go" => Self::LetGo,
            "kept" => Self::Kept,
            "comparison" => Self::Comparison,
            "difference" => Self::Difference,
            "leave" => Self::Leave,
            "open" => Self::Open,
            "save/picture.png" | "save/picture.exr" | "save/scene" => Self::Save(path.strip_prefix("save/")?),
            _ => return None,
        })
    }

    const fn method(&self) -> Method {
        match self {
            Self::Events | Self::Centre | Self::Accuracy | Self::Keep | Self::LetGo => Method::POST,
            Self::Leave | Self::Open => Method::POST,
            _ => Method::GET,
        }
    }
}

async fn answered(counter: &Arc<Counter>, request: Request<Incoming>) -> Result<Answer, Refusal> {
    check_origin(counter.address.ip(), request.headers())?;
    let uri = request.uri().clone();
    let unknown = || Refusal::new(StatusCode::FORBIDDEN, "this address has another token");
    let (token, path) = uri.path().strip_prefix('/').and_then(|path| path.split_once('/')).ok_or_else(unknown)?;
    if !counter.token.is(token) {
        return Err(unknown());
    }
    let route = Route::from_path(path).ok_or_else(|| Refusal::new(StatusCode::NOT_FOUND, "there is nothing here"))?;
    if *request.method() != route.method() {
        return Err(Refusal::new(StatusCode::METHOD_NOT_ALLOWED, "this address takes another method"));
    }
    let query = Query(uri.query().unwrap_or(""));
    match route {
        Route::Page => return Ok(of_type("text/html; charset=utf-8", PAGE)),
        Route::Script(text) => return Ok(of_type("text/javascript; charset=utf-8", text)),
        Route::Style => return Ok(of_type("text/css; charset=utf-8", STYLE)),
        _ => {}
    }
    let name = query.value("client").unwrap_or("");
    if matches!(route, Route::Leave) {
        counter.clients.lock().unwrap_or_else(PoisonError::into_inner).leave(name, Instant::now());
        return Ok(Response::new(Full::default()));
    }
    admit(counter, name)?;
    let session = counter.session();
    let answer = match route {
        Route::State => state(counter, &session, query.number("after")?).await,
        Route::Picture => picture(&session, query.number("after")?).await,
        Route::Events => events(counter, &session, request).await,
        Route::Centre => centre(counter, &session, query.place()?).await,
        Route::Below => below(&session, query.place()?).await,
        Route::Open => open(counter, query.value("name").unwrap_or(""), request).await,
        Route::Accuracy => {
            session.ask_for_accuracy();
            Ok(of_type("application/json", shown(counter, &session)?))
        }
        Route::Keep => {
            let message = "the whole picture is not drawn yet; keep it when it is";
            let refused = || Refusal::new(StatusCode::SERVICE_UNAVAILABLE, message);
            session.keep().then_some(()).ok_or_else(refused)?;
            Ok(of_type("application/json", shown(counter, &session)?))
        }
        Route::LetGo => {
            session.let_go();
            Ok(of_type("application/json", shown(counter, &session)?))
        }
        Route::Kept => {
            let kept = session.kept_picture();
            Ok(kept.map_or_else(nothing, |kept| of_type("image/png", kept.png.clone())))
        }
        Route::Comparison => {
            let found = comparison(&session).await?;
            found.map_or_else(|| Ok(nothing()), |found| Ok(of_type("application/json", json_of(&*found)?)))
        }
        Route::Difference => {
            let found = comparison(&session).await?.filter(|found| !found.png.is_empty());
            found.map_or_else(|| Ok(nothing()), |found| difference(&found))
        }
        Route::Save(what) => saved(&session, what).await,
        Route::Page | Route::Script(_) | Route::Style | Route::Leave => {
            Err(Refusal::new(StatusCode::NOT_FOUND, "there is nothing here"))
        }
    };
    // A page that has waited was there all the time.
    admit(counter, name)?;
    answer
}

/// Refuses pages that another site has made: their origin, or the name by which they found this machine, is another.
fn check_origin(listening: IpAddr, headers: &HeaderMap) -> Result<(), Refusal> {
    let forbidden = |message| Refusal::new(StatusCode::FORBIDDEN, message);
    let text = |name| headers.get(name).map(|value| value.to_str().unwrap_or("?"));
    let host = text(header::HOST).ok_or_else(|| forbidden("the request names no host"))?;
    if headers.get_all(header::HOST).iter().count() > 1 || !is_own_host(listening, host) {
        return Err(forbidden("this server is asked by its numeric address, or as localhost"));
    }
    if text(header::ORIGIN).is_some_and(|origin| origin.strip_prefix("http://") != Some(host)) {
        return Err(forbidden("a page of another origin asks"));
    }
    Ok(())
}

/// Whether a host is this server: a name of the loopback, or the address at which it listens. The port may be that of a tunnel; a name that someone
/// may point at this machine is none of these.
fn is_own_host(listening: IpAddr, host: &str) -> bool {
    let name = match host.rsplit_once(':') {
        Some((name, port)) if !port.is_empty() && port.bytes().all(|b| b.is_ascii_digit()) => name,
        _ => host,
    };
    if name.eq_ignore_ascii_case("localhost") {
        return true;
    }
    let bare = name.strip_prefix('[').and_then(|name| name.strip_suffix(']')).unwrap_or(name);
    let Ok(ip) = bare.parse::<IpAddr>() else { return false };
    ip.is_loopback() || ip == listening || listening.is_unspecified()
}

fn admit(counter: &Counter, name: &str) -> Result<(), Refusal> {
    match counter.clients.lock().unwrap_or_else(PoisonError::into_inner).admit(name, Instant::now()) {
        Admission::Welcome => Ok(()),
        Admission::Nameless => {
            Err(Refusal::new(StatusCode::BAD_REQUEST, "`client`: expected a word of 1 to 64 letters and digits"))
        }
        Admission::Left => Err(Refusal::new(StatusCode::GONE, "this page has said that it is closed; load it again")),
        Admission::Full => {
            let message =
                format!("{MOST_CLIENTS} pages show this scene already; close one of them, then load this page again");
            Err(Refusal::new(StatusCode::CONFLICT, &message))
        }
    }
}

/// The part of an address behind `?`.
struct Query<'q>(&'q str);

impl<'q> Query<'q> {
    fn value(&self, key: &str) -> Option<&'q str> {
        self.0
            .split('&')
            .find_map(|pair| pair.split_once('=').filter(|(found, _)| *found == key))
            .map(|(_, value)| value)
    }

    fn number(&self, key: &str) -> Result<u64, Refusal> {
        let number = self.value(key).unwrap_or("0").parse();
        number.map_err(|_| Refusal::new(StatusCode::BAD_REQUEST, "`after`: expected a whole number"))
    }

    fn share(&self, key: &str) -> Result<f64, Refusal> {
        let share = self.value(key).and_then(|value| value.parse().ok()).filter(|share| (0.0..=1.0).contains(share));
        let message = format!("`{key}`: expected a share of the picture, 0 to 1");
        share.ok_or_else(|| Refusal::new(StatusCode::BAD_REQUEST, &message))
    }

    fn place(&self) -> Result<PicturePlace, Refusal> {
        Ok(PicturePlace { right: self.share("right")?, down: self.share("down")? })
    }
}

/// Turns the scene around what is seen at a place, and answers with the state.
async fn centre(counter: &Counter, session: &Arc<Session>, place: PicturePlace) -> Result<Answer, Refusal> {
    let waiting = Arc::clone(session);
    // Depths come with the next coarse picture: other requests are answered meanwhile.
    let found = tokio::task::spawn_blocking(move || waiting.centre_on(place)).await;
    let found =
        found.map_err(|_| Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "looking below the pointer failed"))?;
    if !found.map_err(|e| Refusal::of_error(&e))? {
        return Err(Refusal::new(StatusCode::NOT_FOUND, "nothing is seen there that the view could be centred on"));
    }
    Ok(of_type("application/json", shown(counter, session)?))
}

/// The state behind a version: at once where it is newer, else when it is, or after a while.
async fn state(counter: &Counter, session: &Session, after: u64) -> Result<Answer, Refusal> {
    let mut versions = session.versions();
    let is_drawing = session.shown().drawing.is_some() || counter.current().next.is_some();
    let patience = if is_drawing { PATIENCE_WHILE_DRAWING } else { PATIENCE };
    // Without news the answer is what was known.
    let _ = timeout(patience, versions.wait_for(|version| *version > after)).await;
    Ok(of_type("application/json", shown(counter, session)?))
}

fn shown(counter: &Counter, session: &Session) -> Result<Vec<u8>, Refusal> {
    let most_file_bytes = counter.opener.as_ref().map(|opener| opener.most_bytes);
    let arriving = counter.current().next.as_ref().and_then(|next| next.session.clone());
    let opening = arriving.and_then(|session| session.shown().drawing);
    json_of(&Told { shown: &session.shown(), most_file_bytes, opening })
}

/// Opens a file that a page hands over, in the place of the view before; where that is refused, the view before goes on.
async fn open(counter: &Arc<Counter>, name: &str, request: Request<Incoming>) -> Result<Answer, Refusal> {
    let refused = |status, message| Refusal::new(status, message);
    let Some(Opener { most_bytes, .. }) = counter.opener else {
        return Err(refused(StatusCode::NOT_FOUND, "this view opens no files; start another one with the file"));
    };
    if content_type(&request) != Some("application/octet-stream") {
        return Err(refused(StatusCode::UNSUPPORTED_MEDIA_TYPE, "expected a file as application/octet-stream"));
    }
    let name = file_name(name)?;
    if counter.session().is_recording() {
        let message =
            "this view is recorded (--record), and a recording is of one scene; start another one with the file";
        return Err(refused(StatusCode::CONFLICT, message));
    }
    let turn = counter.turn.try_acquire();
    let _turn = turn.map_err(|_| refused(StatusCode::CONFLICT, "another file is being opened; try again after it"))?;
    if let Some(bytes) = request.body().size_hint().exact() {
        check_size(bytes, most_bytes)?;
    }
    let received = receive(request.into_body(), name, most_bytes).await?;
    let opening = Arc::clone(counter);
    // Reading takes a while: other requests are answered meanwhile.
    let opened = tokio::task::spawn_blocking(move || open_received(&opening, received)).await;
    opened.map_err(|_| refused(StatusCode::INTERNAL_SERVER_ERROR, "opening this file failed"))??;
    Ok(of_type("application/json", shown(counter, &counter.session())?))
}

/// Opens a file that was received. The data of the view before makes room first; it goes on where the file has no first picture.
fn open_received(counter: &Counter, received: Received) -> Result<(), Refusal> {
    let Some(opener) = &counter.opener else { return Ok(()) };
    let Received { folder, file } = received;
    let before = counter.session();
    counter.current().next = Some(Arriving { folder, session: None });
    let opened = if before.rest() {
        first_picture(counter, opener, file)
    } else {
        let message = "the picture in the making takes long to stop; try again after it";
        Err(Refusal::new(StatusCode::SERVICE_UNAVAILABLE, message))
    };
    match opened {
        Ok(session) => {
            {
                let mut current = counter.current();
                current.session = session;
                current.folder = current.next.take().map(|next| next.folder);
            }
            before.close();
            Ok(())
        }
        Err(refusal) => {
            counter.current().next = None;
            before.wake();
            Err(refusal)
        }
    }
}

/// Begins a session of a file, and waits for its first picture.
///
/// # Errors
/// Why the file cannot be read, converted or drawn.
fn first_picture(counter: &Counter, opener: &Opener, file: GivenFile) -> Result<Arc<Session>, Refusal> {
    let GivenFile { path, name } = &file;
    let session = (opener.open)(file.clone()).map_err(|error| {
        let refusal = Refusal::of_error(&error);
        let message = refusal.message.replace(&organza::printable(path), name);
        Refusal { message, ..refusal }
    })?;
    let session = Arc::new(session);
    if let Some(next) = &mut counter.current().next {
        next.session = Some(Arc::clone(&session));
    } else {
        // The view has ended meanwhile.
        session.close();
    }
    session.first_picture(FIRST_PICTURE).map_err(|Failure { message, hint, .. }| {
        session.close();
        Refusal { status: StatusCode::UNPROCESSABLE_ENTITY, message, hint }
    })?;
    Ok(session)
}

fn content_type(request: &Request<Incoming>) -> Option<&str> {
    request.headers().get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok())
}

/// No news, and no fault.
fn nothing() -> Answer {
    let mut answer = Response::new(Full::default());
    *answer.status_mut() = StatusCode::NO_CONTENT;
    answer
}

/// What lies below a place of the picture.
async fn below(session: &Arc<Session>, place: PicturePlace) -> Result<Answer, Refusal> {
    let session = Arc::clone(session);
    // The nearest of many points takes a while.
    let found = tokio::task::spawn_blocking(move || session.below(place)).await;
    let found =
        found.map_err(|_| Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "looking below the pointer failed"))?;
    // Depths of this view come with its coarse picture.
    found.map_or_else(|| Ok(nothing()), |found| Ok(of_type("application/json", json_of(&found)?)))
}

/// How the present picture differs from the one that was kept; nothing before there are both.
async fn comparison(session: &Arc<Session>) -> Result<Option<Arc<Comparison>>, Refusal> {
    let session = Arc::clone(session);
    // What the eye makes of two pictures takes a while.
    let found = tokio::task::spawn_blocking(move || session.comparison()).await;
    let found = found.map_err(|_| Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "comparing two pictures failed"))?;
    found.map_err(|e| Refusal::of_error(&e))
}

/// A difference, which names the kept picture and the state that it is of.
fn difference(found: &Comparison) -> Result<Answer, Refusal> {
    let mut answer = of_type("image/png", found.png.clone());
    let pair = HeaderValue::from_str(&format!("{}/{}", found.kept, found.generation));
    let pair = pair.map_err(|_| Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "two numbers are no header"))?;
    answer.headers_mut().insert(HeaderName::from_static("organza-pair"), pair);
    Ok(answer)
}

fn json_of(document: &impl Serialize) -> Result<Vec<u8>, Refusal> {
    let bytes = serde_json::to_vec(document);
    bytes.map_err(|e| Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, &format!("the state is no JSON: {e}")))
}

/// The newest picture, where it comes behind a number; no content where none has come for a while.
async fn picture(session: &Session, after: u64) -> Result<Answer, Refusal> {
    let mut versions = session.versions();
    let newer = async {
        while session.picture().is_none_or(|picture| picture.facts.number <= after) && versions.changed().await.is_ok()
        {
        }
    };
    let _ = timeout(PATIENCE, newer).await;
    let Some(picture) = session.picture().filter(|picture| picture.facts.number > after) else {
        return Ok(nothing());
    };
    let mut answer = of_type("image/png", picture.png.clone());
    for (name, number) in [("organza-number", picture.facts.number), ("organza-generation", picture.facts.generation)] {
        answer.headers_mut().insert(HeaderName::from_static(name), HeaderValue::from(number));
    }
    Ok(answer)
}

/// Takes events in, and answers with the state.
async fn events(counter: &Counter, session: &Session, request: Request<Incoming>) -> Result<Answer, Refusal> {
    let bad = |message: &str| Refusal::new(StatusCode::BAD_REQUEST, message);
    if content_type(&request) != Some("application/json") {
        return Err(Refusal::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, "expected events as application/json"));
    }
    let body = Limited::new(request.into_body(), MOST_BODY_BYTES).collect();
    let body = timeout(BODY_TIME, body)
        .await
        .map_err(|_| Refusal::new(StatusCode::REQUEST_TIMEOUT, "the events come too slowly"))?;
    let body = body.map_err(|e| match e.downcast_ref::<LengthLimitError>() {
        Some(_) => Refusal::new(StatusCode::PAYLOAD_TOO_LARGE, "expected at most 64 KiB of events"),
        None => bad("the request broke off"),
    })?;
    let events: Vec<Event> = serde_json::from_slice(&body.to_bytes())
        .map_err(|e| bad(&format!("events: {}", organza::shown(&e.to_string()))))?;
    session.apply(&events).map_err(|e| Refusal::of_error(&e))?;
    Ok(of_type("application/json", shown(counter, session)?))
}

/// A file to save. Its name is given by the page.
async fn saved(session: &Arc<Session>, what: &str) -> Result<Answer, Refusal> {
    if what == "scene" {
        let text = session.scene_text().map_err(|e| Refusal::of_error(&e))?;
        let content = if session.is_json() { "application/json" } else { "application/toml" };
        return Ok(of_type(content, text));
    }
    let is_exr = what == "picture.exr";
    let format = if is_exr { Format::Exr } else { Format::Png };
    let session = Arc::clone(session);
    // A large file takes a while: other requests are answered meanwhile.
    let file = tokio::task::spawn_blocking(move || session.file(format)).await;
    let file = file.map_err(|_| Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, "writing this picture failed"))?;
    let file = file.map_err(|e| Refusal::of_error(&e))?;
    let file = file.ok_or_else(|| {
        Refusal::new(StatusCode::SERVICE_UNAVAILABLE, "the whole picture is not drawn yet; save it when it is")
    })?;
    Ok(of_type(if is_exr { "image/x-exr" } else { "image/png" }, file))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_host_is_this_machine_by_its_number() {
        let loopback: IpAddr = "127.0.0.1".parse().unwrap();
        for host in ["127.0.0.1:80", "localhost:9", "LOCALHOST", "[::1]:8080", "127.0.0.1"] {
            assert!(is_own_host(loopback, host), "{host}");
        }
        for host in [
            "",
            ":",
            "evil.example",
            "evil.example:80",
            "192.168.0.1:80",
            "localhost.evil.example",
            "127.0.0.1.nip.io:1",
            "[::1",
            "1",
        ] {
            assert!(!is_own_host(loopback, host), "{host}");
        }
        let address: IpAddr = "192.168.0.1".parse().unwrap();
        assert!(is_own_host(address, "192.168.0.1:80") && !is_own_host(address, "192.168.0.2:80"));
        assert!(
            is_own_host("0.0.0.0".parse().unwrap(), "192.168.0.2:80")
                && !is_own_host("::".parse().unwrap(), "a.example")
        );
    }

    #[test]
    fn a_query_is_read_by_its_keys() {
        let query = Query("a=1&client=x&after=7");
        assert_eq!([query.value("client"), query.value("a"), query.value("b")], [Some("x"), Some("1"), None]);
        assert_eq!(query.number("after").ok(), Some(7));
        assert!(Query("after=-1").number("after").is_err() && Query("after=").number("after").is_err());
    }
}
