//! The server by real sockets: who is answered, who is refused, and that nobody holds it.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use organza::{Error, Progress, RenderOptions};
use organza_view::{Ended, Framing, GivenFile, Opener, Opening, Server, Session};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::path::PathBuf;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

const SCENE: &str = r#"version = 1
[camera]
position = [0, 0, 4]
target = [0, 0, 0]
size = [24, 16]
[[object]]
name = "fog"
medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 1.5, spacing = 0.25 }
"#;

/// A server that is running.
struct Running {
    session: Arc<Session>,
    address: SocketAddr,
    token: String,
    ending: Arc<Progress>,
    thread: Option<JoinHandle<Ended>>,
}

impl Running {
    fn start() -> Self {
        Self::start_with(|server| server)
    }

    fn start_with(choice: impl FnOnce(Server) -> Server) -> Self {
        let opening = Opening::of_text("scene.toml", SCENE, RenderOptions::default());
        let session = Arc::new(Session::open(opening, &Progress::new()).unwrap());
        let server = choice(Server::bind("127.0.0.1:0".parse().unwrap()).unwrap());
        let url = server.url();
        let rest = url.strip_prefix("http://").unwrap();
        let (address, token) = rest.trim_end_matches('/').split_once('/').unwrap();
        let (address, token) = (address.parse().unwrap(), token.to_owned());
        let ending = Arc::new(Progress::new());
        let thread = std::thread::spawn({
            let (session, ending) = (Arc::clone(&session), Arc::clone(&ending));
            move || server.run(&session, &ending).unwrap()
        });
        Self { session, address, token, ending, thread: Some(thread) }
    }

    fn stop(&mut self) -> Ended {
        self.ending.cancel();
        self.thread.take().unwrap().join().unwrap()
    }

    /// Sends bytes and reads the answer to its end.
    fn raw(&self, request: &[u8]) -> String {
        let mut stream = TcpStream::connect(self.address).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        // A server that refuses early closes before all is sent.
        let _ = stream.write_all(request);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        String::from_utf8_lossy(&answer).into_owned()
    }

    fn ask(&self, line: &str, headers: &str, body: &str) -> Answer {
        let length = if body.is_empty() { String::new() } else { format!("Content-Length: {}\r\n", body.len()) };
        let request = format!("{line} HTTP/1.1\r\nConnection: close\r\n{headers}{length}\r\n{body}");
        Answer::from_text(&self.raw(request.as_bytes()))
    }

    fn host(&self) -> String {
        format!("Host: {}\r\n", self.address)
    }

    fn get(&self, path: &str) -> Answer {
        self.ask(&format!("GET /{}/{path}", self.token), &self.host(), "")
    }

    fn post(&self, body: &str) -> Answer {
        let headers = format!("{}Content-Type: application/json\r\n", self.host());
        self.ask(&format!("POST /{}/events?client=a", self.token), &headers, body)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.ending.cancel();
    }
}

struct Answer {
    status: u16,
    head: String,
    body: String,
}

impl Answer {
    fn from_text(text: &str) -> Self {
        let (head, body) = text.split_once("\r\n\r\n").unwrap_or((text, ""));
        let status = head.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or(0);
        Self { status, head: head.to_lowercase(), body: body.to_owned() }
    }
}

#[test]
fn the_page_and_its_parts_are_served_under_one_policy() {
    let running = Running::start();
    let script = "text/javascript";
    for (path, content) in [
        ("", "text/html"),
        ("page.js", script),
        ("curve.js", script),
        ("cut.js", script),
        ("overlay.js", script),
        ("open.js", script),
        ("judge.js", script),
        ("save.js", script),
        ("page.css", "text/css"),
    ] {
        let answer = running.get(path);
        assert_eq!(answer.status, 200, "{path}");
        assert!(answer.head.contains(content), "{path}: {}", answer.head);
        let policy = answer.head.lines().find(|line| line.starts_with("content-security-policy:")).unwrap().to_owned();
        assert!(policy.contains("default-src 'none'") && !policy.contains("http") && !policy.contains('*'), "{policy}");
        assert!(answer.head.contains("nosniff") && answer.head.contains("no-store"));
        // Nothing is from elsewhere.
        let body = answer.body.replace("http://www.w3.org", "");
        assert!(!body.contains("http://") && !body.contains("https://"), "{path}");
    }
    running.session.whole_picture().unwrap();
    assert_eq!(running.get("state?client=a").status, 200);
    assert_eq!(running.get("picture?client=a&after=0").status, 200);
    assert!(running.get("save/picture.png?client=a").head.contains("image/png"));
    assert!(running.get("save/picture.exr?client=a").head.contains("image/x-exr"));
    assert!(running.get("save/scene?client=a").body.contains("medium_box"));
}

#[test]
fn notebooks_of_this_machine_may_show_the_page_where_that_is_allowed() {
    let running = Running::start_with(|server| server.framed_by(Framing::ThisMachine));
    let answer = running.get("");
    let policy = answer.head.lines().find(|line| line.starts_with("content-security-policy:")).unwrap();
    assert!(policy.ends_with("frame-ancestors http://localhost:* http://127.0.0.1:* http://[::1]:*"), "{policy}");
    assert!(policy.contains("default-src 'none'; script-src 'self'"));
}

#[test]
fn events_change_the_state_or_say_why_not() {
    let running = Running::start();
    let answer = running.post(r#"[{"do": "orbit", "right": 0.25, "up": 0}]"#);
    assert!(answer.status == 200 && answer.body.contains("\"generation\":2"), "{}", answer.body);
    assert!(answer.body.contains("\"azimuth\":-45.0"), "{}", answer.body);
    let refused = running.post(r#"[{"do": "show", "object": "nobody", "visible": true}]"#);
    assert!(refused.status == 422 && refused.body.contains("nobody"), "{}", refused.body);
    for body in ["", "{}", "[1]", "[{\"do\": \"fly\"}]", "[[[[", "\u{0}"] {
        assert!([400, 415].contains(&running.post(body).status), "{body}");
    }
    let deep = "[".repeat(60_000);
    assert_eq!(running.post(&deep).status, 400);
    let headers = format!("{}Content-Type: text/plain\r\n", running.host());
    let plain = running.ask(&format!("POST /{}/events?client=a", running.token), &headers, "[]");
    assert_eq!(plain.status, 415);
    assert_eq!(running.session.shown().generation, 2);
}

#[test]
fn a_place_of_the_picture_is_brought_to_the_middle() {
    let running = Running::start();
    let centre =
        |query: &str| running.ask(&format!("POST /{}/centre?client=a&{query}", running.token), &running.host(), "");
    let answer = centre("right=0.5&down=0.5");
    assert_eq!(answer.status, 200, "{}", answer.body);
    // Half of the light is absorbed 0.46 units behind the front of the fog.
    let [x, y, z] = running.session.shown().viewpoint.centre;
    assert!(x.abs() < 0.1 && y.abs() < 0.1 && (z - 0.54).abs() < 0.2, "{x} {y} {z}");
    assert_eq!(centre("right=0&down=0").status, 404);
    for query in ["right=2&down=0", "right=0.5", "right=NaN&down=0", "right=a&down=b"] {
        assert_eq!(centre(query).status, 400, "{query}");
    }
    assert_eq!(running.get("centre?client=a&right=0.5&down=0.5").status, 405);
}

#[test]
fn a_picture_is_kept_compared_and_let_go() {
    let running = Running::start();
    let post = |path: &str| running.ask(&format!("POST /{}/{path}?client=a", running.token), &running.host(), "");
    assert_eq!(running.get("kept?client=a").status, 204);
    running.session.whole_picture().unwrap();
    assert_eq!(running.get("comparison?client=a").status, 204);
    let kept = post("keep");
    assert!(kept.status == 200 && kept.body.contains("\"kept\":{\"number\":"), "{}", kept.body);
    assert_eq!(running.post(r#"[{"do": "exposure", "stops": 1}]"#).status, 200);
    running.session.whole_picture().unwrap();
    let comparison = running.get("comparison?client=a");
    assert!(comparison.body.contains("\"rmse\":0.") && !comparison.body.contains("png"), "{}", comparison.body);
    for path in ["kept", "difference"] {
        assert!(running.get(&format!("{path}?client=a")).head.contains("image/png"), "{path}");
    }
    // The second state of the view, compared with the picture that was kept.
    let kept = running.session.shown().kept.unwrap().number;
    let difference = running.get("difference?client=a").head;
    assert!(difference.contains(&format!("organza-pair: {kept}/2\r\n")), "{difference}");
    assert_eq!(post("let-go").status, 200);
    assert_eq!(running.get("difference?client=a").status, 204);
    let accuracy = post("accuracy");
    assert!(accuracy.status == 200 && accuracy.body.contains("\"accuracy\":{\"step\":0"), "{}", accuracy.body);
}

#[test]
fn values_below_the_pointer_are_told() {
    let running = Running::start();
    running.session.whole_picture().unwrap();
    let end = Instant::now() + Duration::from_secs(30);
    let below = loop {
        let answer = running.get("below?client=a&right=0.5&down=0.5");
        if answer.status == 200 {
            break answer;
        }
        // Depths come after the whole picture where that is fast.
        assert!(answer.status == 204 && Instant::now() < end, "{}", answer.body);
        std::thread::sleep(Duration::from_millis(20));
    };
    assert!(below.body.contains("\"object\":\"fog\"") && below.body.contains("\"layer\":\"beauty\""), "{}", below.body);
    let beside = running.get("below?client=a&right=0&down=0");
    assert!(beside.body.contains("\"position\":null,\"object\":null"), "{}", beside.body);
    assert_eq!(running.get("below?client=a&right=2&down=0").status, 400);
}

/// Bytes of memory that this process holds.
fn memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.trim().split(' ').next()?.parse::<u64>().ok()).map_or(0, |kib| kib << 10)
}

#[test]
fn a_gigabyte_is_refused_and_ten_thousand_sockets_leave_nothing() {
    let running = Running::start();
    let Running { token, address, .. } = &running;
    running.session.whole_picture().unwrap();
    let before = memory();
    // Announced, or in chunks of unknown number: either ends after a little.
    let chunk = [b" ".repeat(1 << 16), b"\r\n".to_vec()].concat();
    for length in ["Content-Length: 1073741824", "Transfer-Encoding: chunked"] {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.set_write_timeout(Some(Duration::from_secs(12))).unwrap();
        let head = format!(
            "POST /{token}/events?client=a HTTP/1.1\r\nHost: {address}\r\nContent-Type: application/json\r\n{length}\r\n\r\n"
        );
        stream.write_all(head.as_bytes()).unwrap();
        let is_chunked = length.starts_with('T');
        let mut sent = 0u64;
        while sent < 1 << 30 {
            let head = if is_chunked { &b"10000\r\n"[..] } else { &b""[..] };
            let body = if is_chunked { &chunk[..] } else { &chunk[..1 << 16] };
            if stream.write_all(head).and_then(|()| stream.write_all(body)).is_err() {
                break;
            }
            sent += 1 << 16;
        }
        assert!(sent < 1 << 26, "{length}: {sent} bytes were taken");
    }
    for _ in 0..100 {
        let sockets: Vec<TcpStream> = (0..100).filter_map(|_| TcpStream::connect(address).ok()).collect();
        drop(sockets);
    }
    assert_eq!(running.get("").status, 200);
    let more = memory().saturating_sub(before);
    assert!(more < 64 << 20, "{more} bytes");
}

#[test]
fn strangers_are_refused() {
    let running = Running::start();
    let Running { token, address, .. } = &running;
    let host = running.host();
    let other = format!("{}{}", if token.starts_with('0') { "1" } else { "0" }, &token[1..]);
    for path in
        ["/", "/favicon.ico", &format!("/{other}/"), &format!("/{}/", &token[1..]), &format!("/{token}"), "//", "*"]
    {
        let answer = running.ask(&format!("GET {path}"), &host, "");
        assert!([400, 403].contains(&answer.status), "{path}: {}", answer.status);
        assert!(!answer.body.contains(token.as_str()) && !answer.body.contains("<html"), "{path}");
    }
    let page = format!("GET /{token}/");
    for host in ["Host: evil.example\r\n", "Host: evil.example:80\r\n", "", "Host: 127.0.0.1.nip.io\r\n"] {
        assert!([400, 403].contains(&running.ask(&page, host, "").status), "{host}");
    }
    let two = format!("{host}Host: evil.example\r\n");
    assert!([400, 403].contains(&running.ask(&page, &two, "").status));
    for origin in ["http://evil.example", "https://127.0.0.1", "null", "file://", "http://127.0.0.1:1"] {
        let headers = format!("{host}Origin: {origin}\r\nContent-Type: application/json\r\n");
        let answer = running.ask(&format!("POST /{token}/events?client=a"), &headers, "[]");
        assert_eq!(answer.status, 403, "{origin}");
    }
    let headers = format!("{host}Origin: http://{address}\r\nContent-Type: application/json\r\n");
    assert_eq!(running.ask(&format!("POST /{token}/events?client=a"), &headers, "[]").status, 200);
    // Another program's page by a name of this machine, through a tunnel with another port.
    let tunnel = "Host: localhost:9\r\nOrigin: http://localhost:9\r\nContent-Type: application/json\r\n";
    assert_eq!(running.ask(&format!("POST /{token}/events?client=a"), tunnel, "[]").status, 200);
}

#[test]
fn paths_lead_nowhere_else() {
    let running = Running::start();
    for path in [
        "../Cargo.toml",
        "..%2f..%2fetc%2fpasswd",
        "save/../../../etc/passwd",
        "save/scene/../../x",
        "page.js/..",
        "save/picture.png%00",
        "%2e%2e/",
        "save/",
        "picture/1",
        "./page.js",
        "PAGE.JS",
    ] {
        assert_eq!(running.get(path).status, 404, "{path}");
    }
    for line in ["PUT", "DELETE", "OPTIONS", "POST", "HEAD"] {
        let answer = running.ask(&format!("{line} /{}/state?client=a", running.token), &running.host(), "");
        assert_eq!(answer.status, 405, "{line}");
    }
    assert_eq!(running.get("events?client=a").status, 405);
    assert_eq!(running.get("state?client=a&after=x").status, 400);
    for client in ["", "a%20b", "a/b"] {
        assert_eq!(running.get(&format!("state?client={client}")).status, 400, "{client}");
    }
}

#[test]
fn malformed_and_oversized_requests_end() {
    let running = Running::start();
    let Running { token, address, .. } = &running;
    let long = "a".repeat(1 << 20);
    for request in [
        "\r\n\r\n\r\n".to_owned(),
        "\u{0}\u{1}\u{2}\u{3}\r\n\r\n".to_owned(),
        "GET\r\n\r\n".to_owned(),
        format!("GET /{token}/ HTTP/9.9\r\nHost: {address}\r\n\r\n"),
        format!("GET /{token}/{long} HTTP/1.1\r\nHost: {address}\r\n\r\n"),
        format!("GET /{token}/ HTTP/1.1\r\nHost: {address}\r\nX: {long}\r\n\r\n"),
        format!("GET /{token}/ HTTP/1.1\r\nHost: {address}\r\n{}\r\n", "X: y\r\n".repeat(2000)),
        format!("POST /{token}/events?client=a HTTP/1.1\r\nHost: {address}\r\nContent-Length: -1\r\n\r\n"),
        format!(
            "POST /{token}/events?client=a HTTP/1.1\r\nHost: {address}\r\nTransfer-Encoding: chunked\r\nContent-Length: 3\r\nContent-Type: application/json\r\n\r\nzz\r\n"
        ),
    ] {
        let answer = Answer::from_text(&running.raw(request.as_bytes()));
        assert!(answer.status == 0 || answer.status >= 400, "{}: {}", &request[..40.min(request.len())], answer.status);
    }
    let body = format!("[{}]", " ".repeat(100 << 10));
    assert_eq!(running.post(&body).status, 413);
    // One that is announced is refused before it is sent.
    let head = format!(
        "POST /{token}/events?client=a HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\nContent-Type: application/json\r\nContent-Length: 1073741824\r\n\r\n"
    );
    let start = Instant::now();
    assert!([413, 408].contains(&Answer::from_text(&running.raw(head.as_bytes())).status));
    assert!(start.elapsed() < Duration::from_secs(10));
    assert_eq!(running.get("").status, 200);
}

#[test]
fn a_third_page_gets_409_until_one_is_closed() {
    let running = Running::start();
    for (client, status) in [("a", 200), ("b", 200), ("c", 409), ("a", 200)] {
        assert_eq!(running.get(&format!("state?client={client}")).status, status, "{client}");
    }
    assert_eq!(running.get("picture?client=c").status, 409);
    assert_eq!(running.get("save/scene?client=c").status, 409);
    let left = running.ask(&format!("POST /{}/leave?client=b", running.token), &running.host(), "");
    assert_eq!(left.status, 200);
    assert_eq!(running.get("state?client=c").status, 200);
}

#[test]
fn slow_sockets_hold_nobody() {
    let running = Running::start();
    let slow: Vec<TcpStream> = (0..200).filter_map(|_| TcpStream::connect(running.address).ok()).collect();
    for mut stream in &slow {
        let _ = stream.write_all(b"GET /");
    }
    // Heads have five seconds; 200 sockets wait in rows of 32, so a page gets its turn after some of them.
    let start = Instant::now();
    let mut first = slow.first().unwrap();
    first.set_read_timeout(Some(Duration::from_secs(12))).unwrap();
    let mut rest = Vec::new();
    first.read_to_end(&mut rest).unwrap();
    assert!(start.elapsed() < Duration::from_secs(8), "{:?}", start.elapsed());
    drop(slow);
    assert_eq!(running.get("").status, 200);
    // A body that comes byte by byte ends too.
    let mut stream = TcpStream::connect(running.address).unwrap();
    stream.set_read_timeout(Some(Duration::from_secs(12))).unwrap();
    let head = format!(
        "POST /{}/events?client=a HTTP/1.1\r\nHost: {}\r\nContent-Type: application/json\r\nContent-Length: 100\r\nConnection: close\r\n\r\n[",
        running.token, running.address
    );
    stream.write_all(head.as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    assert_eq!(Answer::from_text(&answer).status, 408, "{answer}");
}

#[test]
fn pages_that_wait_hear_of_every_picture() {
    let running = Running::start();
    running.session.whole_picture().unwrap();
    std::thread::scope(|scope| {
        // Two pages ask for news again and again while events come.
        for client in ["a", "b"] {
            let running = &running;
            scope.spawn(move || {
                let mut number = 0;
                while number < 20 {
                    let answer = running.get(&format!("picture?client={client}&after={number}"));
                    assert_eq!(answer.status, 200);
                    let line =
                        answer.head.lines().find_map(|line| line.strip_prefix("organza-number: ")).unwrap().to_owned();
                    let newest: u64 = line.parse().unwrap();
                    assert!(newest > number);
                    number = newest;
                }
            });
        }
        scope.spawn(|| {
            for _ in 0..40 {
                assert_eq!(running.post(r#"[{"do": "orbit", "right": 0.01, "up": 0}]"#).status, 200);
                running.session.whole_picture().unwrap();
            }
        });
    });
}

#[test]
fn it_ends_when_it_is_asked_to_while_requests_wait() {
    let mut running = Running::start();
    running.session.whole_picture().unwrap();
    let version = running.session.shown().version;
    let mut stream = TcpStream::connect(running.address).unwrap();
    let waiting =
        format!("GET /{}/state?client=a&after={version} HTTP/1.1\r\nHost: {}\r\n\r\n", running.token, running.address);
    stream.write_all(waiting.as_bytes()).unwrap();
    std::thread::sleep(Duration::from_millis(100));
    let start = Instant::now();
    assert_eq!(running.stop(), Ended::Asked);
    assert!(start.elapsed() < Duration::from_millis(900), "{:?}", start.elapsed());
}

#[test]
fn it_ends_a_while_after_its_last_page() {
    let mut running = Running::start();
    assert_eq!(running.get("state?client=a").status, 200);
    running.ask(&format!("POST /{}/leave?client=a", running.token), &running.host(), "");
    let start = Instant::now();
    assert_eq!(running.thread.take().unwrap().join().unwrap(), Ended::PagesClosed);
    assert!((15..40).contains(&start.elapsed().as_secs()), "{:?}", start.elapsed());
}

/// Most bytes of a file that is handed over here.
const MOST_BYTES: u64 = 1 << 20;

/// Opens points of a file as a scene beside it.
fn open_points(file: GivenFile) -> Result<Session, Error> {
    let scene = format!(
        "version = 1\n[camera]\nauto = true\nsize = [16, 12]\n[[object]]\nname = \"points\"\npoints = {:?}\n",
        file.name
    );
    let opening = Opening {
        title: file.name.clone(),
        is_fleeting: true,
        ..Opening::of_text(file.path.with_extension("toml"), scene, RenderOptions::default())
    };
    Session::open(Opening { inputs: vec![file], ..opening }, &Progress::new())
}

fn start_opening() -> Running {
    Running::start_with(|server| server.opening(Opener::new(MOST_BYTES, open_points)))
}

impl Running {
    fn open(&self, name: &str, body: &str) -> Answer {
        let headers = format!("{}Content-Type: application/octet-stream\r\n", self.host());
        self.ask(&format!("POST /{}/open?client=a&name={name}", self.token), &headers, body)
    }
}

/// The files of this name that were handed over and are kept.
fn handed_over(name: &str) -> Vec<PathBuf> {
    let folders = std::fs::read_dir(std::env::temp_dir()).unwrap().flatten().map(|entry| entry.path());
    let is_of_view = |path: &PathBuf| path.file_name().unwrap().to_string_lossy().starts_with("organza-view-");
    folders.filter(is_of_view).map(|folder| folder.join(name)).filter(|file| file.exists()).collect()
}

const POINTS: &str = "x,y,z,heat\n0,0,0,1\n1,0,0,2\n0,1,0,3\n";

#[test]
fn a_file_that_is_handed_over_takes_the_place_of_the_view_before() {
    let mut running = start_opening();
    running.session.whole_picture().unwrap();
    let before = running.get("state?client=a").body;
    assert!(before.contains("\"most_file_bytes\":1048576"), "{before}");
    for name in ["first%20points.csv", "second.csv"] {
        let answer = running.open(name, POINTS);
        let name = name.replace("%20", " ");
        assert!(answer.status == 200 && answer.body.contains(&format!("\"title\":\"{name}\"")), "{}", answer.body);
        assert_eq!(handed_over(&name).len(), 1, "{name}");
    }
    // What it took the place of is gone, and a scene that is saved names the file alone.
    assert!(handed_over("first points.csv").is_empty());
    let end = Instant::now() + Duration::from_secs(30);
    while running.get("save/picture.png?client=a").status != 200 {
        assert!(Instant::now() < end, "{}", running.get("state?client=a").body);
        std::thread::sleep(Duration::from_millis(20));
    }
    let scene = running.get("save/scene?client=a").body;
    assert!(scene.contains("points = \"second.csv\"") && !scene.contains("organza-view-"), "{scene}");
    assert_eq!(running.stop(), Ended::Asked);
    assert!(handed_over("second.csv").is_empty());
}

#[test]
fn a_file_that_cannot_be_opened_is_refused_by_its_name_and_the_view_before_goes_on() {
    let running = start_opening();
    running.session.whole_picture().unwrap();
    let broken = running.open("broken.csv", "x,y,z\n0,0,zero\n");
    assert!(
        broken.status == 422 && broken.body.contains("\"broken.csv:2:") && !broken.body.contains("organza-view-"),
        "{}",
        broken.body
    );
    let lacking = running.open(
        "lacking.nhdr",
        "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: /etc/hostname\n\n",
    );
    assert!(lacking.status == 422, "{}", lacking.body);
    assert!(handed_over("broken.csv").is_empty() && handed_over("lacking.nhdr").is_empty());
    assert!(running.session.whole_picture().is_ok() && running.get("state?client=a").body.contains("scene.toml"));
}

#[test]
fn a_file_that_is_read_and_cannot_be_drawn_leaves_the_view_before() {
    let running = start_opening();
    running.session.whole_picture().unwrap();
    // Discs of so many spacings reach farther than the points are apart: conversion refuses them.
    let answer = running.open("wide.csv", "x,y,z,footprint\n0,0,0,7\n1,0,0,7\n0,1,0,7\n");
    assert!(answer.status == 422 && answer.body.contains("footprint"), "{}", answer.body);
    assert!(handed_over("wide.csv").is_empty());
    let end = Instant::now() + Duration::from_secs(30);
    while running.get("save/picture.png?client=a").status != 200 {
        assert!(Instant::now() < end, "{}", running.get("state?client=a").body);
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(running.get("state?client=a").body.contains("scene.toml"));
}

#[test]
fn files_of_strangers_and_names_that_lead_elsewhere_are_refused() {
    let running = start_opening();
    let Running { token, address, .. } = &running;
    let host = running.host();
    let kind = "Content-Type: application/octet-stream\r\n";
    let open = format!("POST /{token}/open?client=a&name=stranger.csv");
    let evil = format!("{host}Origin: http://evil.example\r\n{kind}");
    for (line, headers, status) in [
        (open.as_str(), evil.as_str(), 403),
        (open.as_str(), &format!("Host: evil.example\r\n{kind}"), 403),
        ("POST /0123/open?client=a&name=stranger.csv", &format!("{host}{kind}"), 403),
        (&format!("POST /{token}/open?name=stranger.csv"), &format!("{host}{kind}"), 400),
        (&format!("GET /{token}/open?client=a&name=stranger.csv"), &format!("{host}{kind}"), 405),
        (open.as_str(), &format!("{host}Content-Type: text/plain\r\n"), 415),
        (open.as_str(), host.as_str(), 415),
    ] {
        assert_eq!(running.ask(line, headers, POINTS).status, status, "{line}\n{headers}");
    }
    for name in [
        "../stranger.csv",
        "..%2Fstranger.csv",
        "%2Ftmp%2Fstranger.csv",
        "..",
        "",
        "stranger.csv%00",
        "a%5Cstranger.csv",
    ] {
        assert_eq!(running.open(name, POINTS).status, 400, "{name}");
    }
    assert!(handed_over("stranger.csv").is_empty() && !std::env::temp_dir().join("stranger.csv").exists());
    // A view without an opener takes none.
    assert_eq!(Running::start().open("stranger.csv", POINTS).status, 404);
    assert!(running.get("state?client=a").body.contains("scene.toml"), "{address}");
}

#[test]
fn a_file_of_a_gigabyte_ends_and_slow_ones_hold_nobody() {
    let running = start_opening();
    let Running { token, address, .. } = &running;
    running.session.whole_picture().unwrap();
    let before = memory();
    let begun = |name: &str, length: &str| {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.set_write_timeout(Some(Duration::from_secs(12))).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(20))).unwrap();
        let head = format!(
            "POST /{token}/open?client=a&name={name} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\
             Content-Type: application/octet-stream\r\n{length}\r\n\r\n"
        );
        stream.write_all(head.as_bytes()).unwrap();
        stream
    };
    let chunk = [&b"10000\r\n"[..], &b" ".repeat(1 << 16), b"\r\n"].concat();
    for length in ["Content-Length: 1073741824", "Transfer-Encoding: chunked"] {
        let mut stream = begun("huge.csv", length);
        let body = if length.starts_with('T') { &chunk[..] } else { &chunk[7..7 + (1 << 16)] };
        let mut sent = 0u64;
        while sent < 1 << 30 && stream.write_all(body).is_ok() {
            sent += 1 << 16;
        }
        assert!(sent < 1 << 26, "{length}: {sent} bytes were taken");
    }
    assert!(memory().saturating_sub(before) < 64 << 20);
    // A byte now and then: the next of them does not come in time. Others are answered meanwhile.
    let mut slow = begun("slow.csv", "Content-Length: 1000");
    slow.write_all(b"x").unwrap();
    let end = Instant::now() + Duration::from_secs(4);
    while handed_over("slow.csv").is_empty() {
        assert!(Instant::now() < end);
        std::thread::sleep(Duration::from_millis(10));
    }
    let start = Instant::now();
    assert_eq!(running.get("state?client=b").status, 200);
    assert!(start.elapsed() < Duration::from_secs(1));
    assert_eq!(running.open("other.csv", POINTS).status, 409);
    let mut answer = String::new();
    let _ = slow.read_to_string(&mut answer);
    assert!(answer.starts_with("HTTP/1.1 408"), "{answer}");
    // One that breaks off leaves nothing either, and makes room for the next.
    drop(begun("broken-off.csv", "Content-Length: 1000"));
    let end = Instant::now() + Duration::from_secs(10);
    while running.open("other.csv", POINTS).status != 200 {
        assert!(Instant::now() < end, "nobody else opens a file");
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(["huge.csv", "slow.csv", "broken-off.csv"].iter().all(|name| handed_over(name).is_empty()));
}
