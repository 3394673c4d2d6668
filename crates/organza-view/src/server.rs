//! The server of the page: sockets, their limits, and when it ends.

mod clients;
mod serving;
mod token;
mod upload;

use crate::session::Session;
use clients::Clients;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use organza::{Error, Progress};
use serving::{Counter, Current, answer};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};
use std::path::Path;
use std::pin::pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use token::Token;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::Semaphore;
use tokio::time::{sleep, timeout};
pub use upload::Opener;

/// Sockets that are served at a time; others wait until one is free.
const MOST_SOCKETS: usize = 32;

/// Time in which a request's head has to be there, also of the next one on a socket: it bounds how long an idle socket stays.
const HEAD_TIME: Duration = Duration::from_secs(5);

/// Time after which a socket takes no more requests, and time for the last one: an answer that nobody reads holds nothing for longer.
const SOCKET_TIME: Duration = Duration::from_secs(60);
const LAST_ANSWER_TIME: Duration = Duration::from_secs(30);

/// Most bytes of a request's head.
const MOST_HEAD_BYTES: usize = 16 << 10;

/// Time between two looks whether it is to end.
const LOOK: Duration = Duration::from_millis(50);

/// Time that answers in the making have when it ends.
const FAREWELL: Duration = Duration::from_millis(100);

/// A server that has its address, and serves nobody yet.
pub struct Server {
    listener: std::net::TcpListener,
    address: SocketAddr,
    token: Token,
    framing: Framing,
    opener: Option<Opener>,
}

/// The pages that may embed this page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Framing {
    /// None.
    Nobody,
    /// Those of this machine, as notebooks are.
    ThisMachine,
}

/// Why a server has ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ended {
    /// It was asked to.
    Asked,
    /// All pages are closed.
    PagesClosed,
}

impl Server {
    /// Takes an address; port 0 is any that is free. Programs of other machines reach it only where the address is not of the loopback.
    ///
    /// # Errors
    /// [`Error::Io`] where the system refuses the address.
    pub fn bind(address: SocketAddr) -> Result<Self, Error> {
        let fail = |e| Error::io(Path::new(&address.to_string()), "cannot listen at this address", e);
        let listener = std::net::TcpListener::bind(address).map_err(fail)?;
        listener.set_nonblocking(true).map_err(fail)?;
        let address = listener.local_addr().map_err(fail)?;
        Ok(Self { listener, address, token: Token::new()?, framing: Framing::Nobody, opener: None })
    }

    /// Returns the server with another choice of pages that may embed its page.
    #[must_use]
    pub fn framed_by(self, framing: Framing) -> Self {
        Self { framing, ..self }
    }

    /// Returns the server with an opener of data files that a page hands over; others open none.
    #[must_use]
    pub fn opening(self, opener: Opener) -> Self {
        Self { opener: Some(opener), ..self }
    }

    /// The address of the page, with its token.
    pub fn url(&self) -> String {
        let ip = self.address.ip();
        let ip = if ip.is_unspecified() { own_address(ip) } else { ip };
        format!("http://{}/{}/", SocketAddr::new(ip, self.address.port()), self.token.text())
    }

    /// Serves a session until `ending` is cancelled, or all pages are closed.
    ///
    /// # Errors
    /// [`Error::Internal`] where the system has no sockets for it.
    pub fn run(self, session: &Arc<Session>, ending: &Progress) -> Result<Ended, Error> {
        let internal = |e: std::io::Error| Error::Internal(format!("the server of the page: {e}"));
        let runtime =
            tokio::runtime::Builder::new_current_thread().enable_io().enable_time().build().map_err(internal)?;
        let Self { listener, address, token, framing, opener } = self;
        let clients = Mutex::new(Clients::default());
        let current = Mutex::new(Current::new(Arc::clone(session)));
        let turn = Semaphore::new(1);
        let counter = Arc::new(Counter { current, clients, token, address, framing, opener, turn });
        let ended = runtime.block_on(async {
            let listener = TcpListener::from_std(listener).map_err(internal)?;
            tokio::spawn(accept(listener, Arc::clone(&counter)));
            loop {
                if ending.is_cancelled() {
                    return Ok(Ended::Asked);
                }
                if counter.clients.lock().unwrap_or_else(PoisonError::into_inner).are_gone(Instant::now()) {
                    return Ok(Ended::PagesClosed);
                }
                sleep(LOOK).await;
            }
        });
        runtime.shutdown_timeout(FAREWELL);
        // Also where a file is being opened still.
        counter.current().end();
        ended
    }
}

/// The address by which other machines reach this one: the one from which it would send to them. Without a network it is the loopback's.
fn own_address(everywhere: IpAddr) -> IpAddr {
    // Addresses for documentation, which no machine has. A datagram socket that is connected sends nothing.
    let [loopback, far] = match everywhere {
        IpAddr::V4(_) => [IpAddr::V4(Ipv4Addr::LOCALHOST), IpAddr::V4(Ipv4Addr::new(192, 0, 2, 1))],
        IpAddr::V6(_) => [IpAddr::V6(Ipv6Addr::LOCALHOST), IpAddr::V6(Ipv6Addr::new(0x2001, 0xdb8, 0, 0, 0, 0, 0, 1))],
    };
    let found = UdpSocket::bind((everywhere, 0)).and_then(|socket| {
        socket.connect((far, 9))?;
        socket.local_addr()
    });
    found.map(|address| address.ip()).ok().filter(|ip| !ip.is_unspecified()).unwrap_or(loopback)
}

async fn accept(listener: TcpListener, counter: Arc<Counter>) {
    let sockets = Arc::new(Semaphore::new(MOST_SOCKETS));
    loop {
        let Ok(permit) = Arc::clone(&sockets).acquire_owned().await else { return };
        let Ok((stream, _)) = listener.accept().await else {
            // The system has no more sockets: some are free soon.
            sleep(LOOK).await;
            continue;
        };
        let counter = Arc::clone(&counter);
        tokio::spawn(async move {
            serve(stream, counter).await;
            drop(permit);
        });
    }
}

async fn serve(stream: TcpStream, counter: Arc<Counter>) {
    // Answers of a drag are small, and are not to wait for more.
    let _ = stream.set_nodelay(true);
    let service = service_fn(move |request| {
        let counter = Arc::clone(&counter);
        async move { Ok::<_, std::convert::Infallible>(answer(&counter, request).await) }
    });
    let mut builder = http1::Builder::new();
    builder.timer(TokioTimer::new()).header_read_timeout(HEAD_TIME).max_buf_size(MOST_HEAD_BYTES);
    let mut connection = pin!(builder.serve_connection(TokioIo::new(stream), service));
    // A socket that fails is closed: its page asks again by another.
    if timeout(SOCKET_TIME, connection.as_mut()).await.is_err() {
        connection.as_mut().graceful_shutdown();
        let _ = timeout(LAST_ANSWER_TIME, connection).await;
    }
}
