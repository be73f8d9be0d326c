//! A server of static files for this machine alone.

use anyhow::{Result, anyhow};
use std::fs::File;
use std::path::{Component, Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use tiny_http::{Header, Response, Server};

/// Types of the files that a page is made of.
const TYPES: [(&str, &str); 5] = [
    ("html", "text/html; charset=utf-8"),
    ("js", "text/javascript; charset=utf-8"),
    ("css", "text/css; charset=utf-8"),
    ("wasm", "application/wasm"),
    ("md", "text/plain; charset=utf-8"),
];

/// Serves a folder until the program is interrupted, and opens it in the user's browser if that is wanted.
pub fn serve(folder: &Path, port: u16, opens: bool) -> Result<()> {
    let (server, address) = listen(port)?;
    println!("{address}   (Ctrl-C ends it)");
    if opens {
        let opener = if cfg!(target_os = "macos") { "open" } else { "xdg-open" };
        if Command::new(opener).arg(&address).spawn().is_err() {
            println!("open it in a browser: {opener} is not here");
        }
    }
    answer(&server, folder);
    Ok(())
}

/// Serves a folder behind the program's back; its address.
pub fn serve_aside(folder: &Path) -> Result<String> {
    let (server, address) = listen(0)?;
    let folder = folder.to_owned();
    std::thread::spawn(move || answer(&server, &folder));
    Ok(address)
}

fn listen(port: u16) -> Result<(Arc<Server>, String)> {
    let server = Server::http(("127.0.0.1", port)).map_err(|error| anyhow!("--port {port}: {error}"))?;
    let port = server.server_addr().to_ip().map_or(port, |address| address.port());
    Ok((Arc::new(server), format!("http://127.0.0.1:{port}/")))
}

fn answer(server: &Server, folder: &Path) {
    for request in server.incoming_requests() {
        // What the browser at the other end does with the answer is its own business.
        let _ = match file(folder, request.url()) {
            Some((file, kind)) => {
                let header = Header::from_bytes("Content-Type", kind);
                request.respond(header.into_iter().fold(Response::from_file(file), Response::with_header))
            }
            None => request.respond(Response::from_string("not found").with_status_code(404)),
        };
    }
}

/// The file of an address, and its type; none outside the folder.
fn file(folder: &Path, url: &str) -> Option<(File, &'static str)> {
    let path = url.split(['?', '#']).next()?.trim_start_matches('/');
    let path = PathBuf::from(if path.is_empty() { "index.html" } else { path });
    if path.components().any(|part| !matches!(part, Component::Normal(_))) {
        return None;
    }
    let (_, kind) =
        TYPES.iter().find(|(extension, _)| path.extension().is_some_and(|of| of == *extension))?;
    Some((File::open(folder.join(&path)).ok()?, kind))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_outside_the_folder_are_not_there() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../page");
        assert!(file(&folder, "/").is_some());
        assert!(file(&folder, "/worker.js?x").is_some());
        assert!(file(&folder, "/../vendor/uPlot.min.css").is_none());
        assert!(file(&folder, "//etc/passwd.js").is_none());
        assert!(file(&folder, "/absent.js").is_none());
    }
}
