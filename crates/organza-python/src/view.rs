//! A scene on a page of the browser, served until the caller closes it or the program ends.

use crate::calls::{Given, How};
use crate::errors::raised;
use crate::running::run;
use organza::{Error, Files, Progress};
use organza_view::{Framing, Opening, Server, Session};
use pyo3::prelude::*;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

/// A scene on a page, and the thread that serves it.
#[pyclass(module = "organza._organza", frozen)]
pub(crate) struct View {
    url: String,
    session: Arc<Session>,
    ending: Arc<Progress>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

#[pymethods]
impl View {
    /// The address of the page.
    #[getter]
    fn url(&self) -> &str {
        &self.url
    }

    /// Whether the page is still served: it ends a while after its last page was closed.
    #[getter]
    fn is_open(&self) -> bool {
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner);
        thread.as_ref().is_some_and(|thread| !thread.is_finished())
    }

    /// The scene as it is seen, as the text of a scene file.
    fn scene_text(&self) -> PyResult<String> {
        self.session.scene_text().map_err(|error| raised(&error))
    }

    /// Ends the view, and waits until nothing is served any more.
    fn close(&self, py: Python<'_>) {
        self.ending.cancel();
        let thread = self.thread.lock().unwrap_or_else(PoisonError::into_inner).take();
        py.detach(|| {
            // A server that panicked serves nothing either.
            let _ = thread.map(JoinHandle::join);
            self.session.close();
        });
    }
}

impl Drop for View {
    fn drop(&mut self) {
        // The thread ends by itself soon.
        self.ending.cancel();
    }
}

/// Serves a page of a scene on this machine.
#[pyfunction]
pub(crate) fn view(py: Python<'_>, mut given: Given, title: String, how: How<'_>) -> PyResult<View> {
    let options = how.options();
    let in_memory = given.take_memory()?;
    let work = move |progress: &Progress| {
        let load = given.load(in_memory, &options)?;
        let text = given.text.clone().into_bytes();
        let file = given.file.clone();
        let files = Files::default();
        let opening = Opening { title, inputs: Vec::new(), is_fleeting: false, file, text, load, options, files };
        let server = Server::bind(SocketAddr::from((Ipv4Addr::LOCALHOST, 0)))?.framed_by(Framing::ThisMachine);
        Ok((server, Arc::new(Session::open(opening, progress)?)))
    };
    let (server, session) = run(py, how.threads, how.progress.as_ref(), work)?;
    let url = server.url();
    let ending = Arc::new(Progress::new());
    let served = Arc::clone(&session);
    let until = Arc::clone(&ending);
    let serve = move || {
        // A server without sockets ends at once, which `is_open` says.
        let _ = server.run(&served, &until);
        served.close();
    };
    let thread = std::thread::Builder::new().name("view".into()).spawn(serve);
    let thread = thread.map_err(|e| raised(&Error::Internal(format!("a thread that serves the page: {e}"))))?;
    Ok(View { url, session, ending, thread: Mutex::new(Some(thread)) })
}
