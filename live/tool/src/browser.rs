//! A headless Chromium, over its DevTools protocol.

use anyhow::{Context, Result, anyhow, bail};
use serde_json::{Value, json};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;
use tungstenite::{Message, WebSocket};

/// The words that it is called with; it talks to nobody but this machine.
const WORDS: [&str; 13] = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-default-apps",
    "--disable-dev-shm-usage",
    "--hide-scrollbars=false",
    "--remote-debugging-port=0",
    "about:blank",
];
/// Time within which it starts, or answers.
const PATIENCE: Duration = Duration::from_secs(300);
/// Time between two looks.
const PAUSE: Duration = Duration::from_millis(50);

/// A page in a browser of its own.
pub struct Browser {
    process: Child,
    socket: WebSocket<TcpStream>,
    session: String,
    number: u64,
    /// The errors that the page or its worker has told.
    pub errors: Vec<String>,
    _profile: TempDir,
}

impl Browser {
    /// Starts it.
    pub fn start(program: &Path) -> Result<Self> {
        let profile = tempfile::tempdir()?;
        let process = Command::new(program)
            .args(WORDS)
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .with_context(|| format!("cannot start {}", program.display()))?;
        let (port, path) = endpoint(profile.path())?;
        let stream = TcpStream::connect(("127.0.0.1", port))?;
        stream.set_read_timeout(Some(PATIENCE))?;
        let (socket, _) = tungstenite::client(format!("ws://127.0.0.1:{port}{path}"), stream)
            .map_err(|error| anyhow!("DevTools: {error}"))?;
        let mut browser = Self {
            process,
            socket,
            session: String::new(),
            number: 0,
            errors: Vec::new(),
            _profile: profile,
        };
        let target = browser.call("Target.createTarget", json!({ "url": "about:blank" }))?;
        let attached = browser
            .call("Target.attachToTarget", json!({ "targetId": target["targetId"], "flatten": true }))?;
        browser.session = attached["sessionId"].as_str().context("DevTools: no session")?.to_owned();
        for domain in ["Page.enable", "Runtime.enable", "Log.enable"] {
            browser.call(domain, json!({}))?;
        }
        Ok(browser)
    }

    /// Goes to an address, as if nothing had been open before.
    pub fn go(&mut self, address: &str) -> Result<()> {
        // An address that differs behind its `#` alone would be the same page still.
        self.call("Page.navigate", json!({ "url": "about:blank" }))?;
        self.until("the page before is gone", "location.href === 'about:blank'")?;
        self.errors.clear();
        self.call("Page.navigate", json!({ "url": address }))?;
        // What is not in front is not drawn.
        self.call("Page.bringToFront", json!({})).map(|_| ())
    }

    /// A window of this size, in CSS pixels, dark or light.
    pub fn resize(&mut self, width: u32, height: u32, dark: bool) -> Result<()> {
        let size = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600 });
        self.call("Emulation.setDeviceMetricsOverride", size)?;
        let scheme = if dark { "dark" } else { "light" };
        let media = json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] });
        self.call("Emulation.setEmulatedMedia", media).map(|_| ())
    }

    /// The value of an expression, or of its promise.
    pub fn evaluate(&mut self, expression: &str) -> Result<Value> {
        let words = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let answer = self.call("Runtime.evaluate", words)?;
        match answer.get("exceptionDetails") {
            Some(details) => bail!("{expression}: {}", details["exception"]["description"]),
            None => Ok(answer["result"]["value"].clone()),
        }
    }

    /// Waits until an expression is true.
    pub fn until(&mut self, what: &str, expression: &str) -> Result<()> {
        let began = Instant::now();
        while self.evaluate(expression)? != json!(true) {
            if began.elapsed() > PATIENCE {
                let text = self.evaluate("document.body.innerText.slice(0, 400)")?;
                bail!(
                    "{what}: not so after {} s; errors {:?}; the page says {text}",
                    PATIENCE.as_secs(),
                    self.errors
                );
            }
            std::thread::sleep(PAUSE);
        }
        Ok(())
    }

    /// Presses a key, by its name in the DOM.
    pub fn press(&mut self, key: &str) -> Result<()> {
        for kind in ["keyDown", "keyUp"] {
            self.call("Input.dispatchKeyEvent", json!({ "type": kind, "key": key }))?;
        }
        Ok(())
    }

    /// A picture of the window as it is seen, PNG in base 64.
    pub fn picture(&mut self) -> Result<String> {
        let answer = self.call("Page.captureScreenshot", json!({ "format": "png" }))?;
        Ok(answer["data"].as_str().context("DevTools: no picture")?.to_owned())
    }

    fn call(&mut self, method: &str, words: Value) -> Result<Value> {
        self.number += 1;
        let mut message = json!({ "id": self.number, "method": method, "params": words });
        if !self.session.is_empty() {
            message["sessionId"] = self.session.clone().into();
        }
        self.socket.send(Message::text(message.to_string()))?;
        loop {
            let Message::Text(text) = self.socket.read().context("DevTools")? else { continue };
            let answer: Value = serde_json::from_str(&text)?;
            if answer["id"] == json!(self.number) {
                return match answer.get("error") {
                    Some(error) => bail!("{method}: {}", error["message"]),
                    None => Ok(answer["result"].clone()),
                };
            }
            self.note(&answer);
        }
    }

    /// Keeps what is an error.
    fn note(&mut self, event: &Value) {
        let of = &event["params"];
        match event["method"].as_str() {
            Some("Runtime.exceptionThrown") => self.errors.push(of["exceptionDetails"].to_string()),
            Some("Runtime.consoleAPICalled") if of["type"] == "error" => {
                self.errors.push(of["args"].to_string())
            }
            Some("Log.entryAdded") if of["entry"]["level"] == "error" => {
                self.errors.push(of["entry"].to_string())
            }
            _ => {}
        }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // It may be gone already.
        let _ = self.call("Browser.close", json!({}));
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Port and path of its DevTools, which it writes down once it listens.
fn endpoint(profile: &Path) -> Result<(u16, String)> {
    let began = Instant::now();
    while began.elapsed() < PATIENCE {
        let text = std::fs::read_to_string(profile.join("DevToolsActivePort")).unwrap_or_default();
        if let Some((port, path)) = text.split_once('\n') {
            return Ok((port.parse()?, path.trim().to_owned()));
        }
        std::thread::sleep(PAUSE);
    }
    bail!("the browser has not started within {} s", PATIENCE.as_secs())
}
