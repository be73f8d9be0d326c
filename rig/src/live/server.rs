//! The page's server, for this machine alone.

use super::shared::Shared;
use anyhow::{Result, anyhow};
use serde_json::Value;
use std::io::{Cursor, Read};
use std::sync::Arc;
use tiny_http::{Header, Method, Request, Response, Server};

/// A file of the page: its path, type and text.
type File = (&'static str, &'static str, &'static str);

const JS: &str = "text/javascript; charset=utf-8";
const CSS: &str = "text/css; charset=utf-8";

/// The page, with a drive elsewhere in place of the simulation.
const FILES: [File; 11] = [
    ("/", "text/html; charset=utf-8", include_str!("../../../live/page/index.html")),
    ("/style.css", CSS, include_str!("../../../live/page/style.css")),
    ("/main.js", JS, include_str!("../../../live/page/main.js")),
    ("/controls.js", JS, include_str!("../../../live/page/controls.js")),
    ("/systems.js", JS, include_str!("../../../live/page/systems.js")),
    ("/scope.js", JS, include_str!("../../../live/page/scope.js")),
    ("/views.js", JS, include_str!("../../../live/page/views.js")),
    ("/mcap.js", JS, include_str!("../../../live/page/mcap.js")),
    ("/worker.js", JS, include_str!("../../../live/page/remote.js")),
    ("/vendor/uPlot.min.css", CSS, include_str!("../../../live/vendor/uPlot.min.css")),
    ("/vendor/uPlot.iife.min.js", JS, include_str!("../../../live/vendor/uPlot.iife.min.js")),
];

/// The header that a page of another origin cannot send unasked.
const HEADER: &str = "X-Tractive";
/// The longest line, in bytes.
const LONGEST_LINE: u64 = 200;

type Answer = Response<Cursor<Vec<u8>>>;

/// Serves in the background; returns the address.
pub fn serve(port: u16, about: Value, shared: Arc<Shared>) -> Result<String> {
    let server = Server::http(("127.0.0.1", port)).map_err(|error| anyhow!("--port {port}: {error}"))?;
    let port = server.server_addr().to_ip().map_or(port, |address| address.port());
    std::thread::spawn(move || {
        for mut request in server.incoming_requests() {
            let answer = answer(&mut request, &about, &shared, port);
            // A browser that does not take the answer is no concern of the server.
            let _ = request.respond(answer);
        }
    });
    Ok(format!("http://127.0.0.1:{port}/"))
}

fn answer(request: &mut Request, about: &Value, shared: &Shared, port: u16) -> Answer {
    if !is_own(request, port) {
        return refused(403, "only pages of this server may ask");
    }
    let url = request.url().to_owned();
    let (path, query) = url.split_once('?').unwrap_or((&url, ""));
    if *request.method() == Method::Post {
        let mut text = String::new();
        if request.as_reader().take(LONGEST_LINE).read_to_string(&mut text).is_err() {
            return refused(400, "that is no text");
        }
        let done = match path {
            "/arm" => shared.arm(text == "on"),
            "/line" => shared.say(&text),
            _ => return refused(404, "not found"),
        };
        return done.map_or_else(|why| refused(409, why), |()| typed("{}", "application/json"));
    }
    match path {
        "/about" => typed(&about.to_string(), "application/json"),
        "/rows" => {
            let from = query.strip_prefix("from=").and_then(|from| from.parse().ok()).unwrap_or(0);
            typed(&shared.rows(from).to_string(), "application/json")
        }
        _ => match FILES.iter().find(|(name, ..)| *name == path) {
            Some((_, kind, text)) => typed(text, kind),
            None => refused(404, "not found"),
        },
    }
}

/// `true` for a request that names this server as its host and, if it commands, comes from its own page.
fn is_own(request: &Request, port: u16) -> bool {
    let header = |name: &'static str| {
        request.headers().iter().find(|header| header.field.equiv(name)).map(|header| header.value.as_str())
    };
    let hosts = [format!("127.0.0.1:{port}"), format!("localhost:{port}")];
    let host = header("Host").is_some_and(|host| hosts.iter().any(|own| own == host));
    host && (*request.method() == Method::Get
        || (*request.method() == Method::Post && header(HEADER).is_some()))
}

fn typed(text: &str, kind: &str) -> Answer {
    let header = Header::from_bytes("Content-Type", kind);
    header.into_iter().fold(Response::from_string(text), Response::with_header)
}

fn refused(code: u16, why: &str) -> Answer {
    Response::from_string(why).with_status_code(code)
}
