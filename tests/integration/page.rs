//! A page in a browser without a window, driven through the browser's own protocol (Chrome DevTools
//! Protocol, over a pipe).

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// Time within which something happens in a page.
const DEADLINE: Duration = Duration::from_secs(120);

/// A page that is shown.
pub(crate) struct Page {
    browser: Child,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    session: Option<String>,
    count: u64,
    events: Vec<Value>,
}

impl Page {
    /// Opens an address. `profile` is a folder for the browser's data.
    ///
    /// # Panics
    /// If the browser does not start.
    pub(crate) fn open(browser: &str, profile: &Path, address: &str) -> Self {
        // The protocol uses the file descriptors 3 and 4.
        let script = r#"exec "$0" --headless --no-sandbox --disable-gpu "$1" --remote-debugging-pipe about:blank 3<&0 4>&1 >/dev/null 2>&1"#;
        let mut browser = Command::new("sh")
            .args(["-c", script, browser, &format!("--user-data-dir={}", profile.display())])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("a shell");
        let (input, output) = (browser.stdin.take().expect("a pipe"), browser.stdout.take().expect("a pipe"));
        let output = BufReader::new(output);
        let mut page = Self { browser, input, output, session: None, count: 0, events: Vec::new() };
        let target = page.command("Target.createTarget", &json!({ "url": "about:blank" }));
        let attached = json!({ "targetId": target["targetId"], "flatten": true });
        page.session = page.command("Target.attachToTarget", &attached)["sessionId"].as_str().map(str::to_owned);
        for domain in ["Network.enable", "Runtime.enable", "Log.enable", "Page.enable"] {
            page.command(domain, &json!({}));
        }
        page.command("Page.navigate", &json!({ "url": address }));
        page
    }

    /// Sends a command of the protocol, and returns its result.
    ///
    /// # Panics
    /// If the browser refuses the command, or has ended.
    pub(crate) fn command(&mut self, method: &str, parameters: &Value) -> Value {
        self.count += 1;
        let mut message = json!({ "id": self.count, "method": method, "params": parameters });
        if let Some(session) = &self.session {
            message["sessionId"] = json!(session);
        }
        self.input.write_all(format!("{message}\0").as_bytes()).expect("the browser reads");
        loop {
            let mut bytes = Vec::new();
            self.output.read_until(0, &mut bytes).expect("the browser writes");
            assert_eq!(bytes.pop(), Some(0), "the browser has ended");
            let answer: Value = serde_json::from_slice(&bytes).expect("JSON");
            if answer["id"] == json!(self.count) {
                assert!(answer["error"].is_null(), "{method}: {answer}");
                return answer["result"].clone();
            }
            self.events.push(answer);
        }
    }

    /// Sets the size of the window (px), and whether the page is dark.
    pub(crate) fn set_window(&mut self, [width, height]: [u32; 2], is_dark: bool) {
        let size = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        self.command("Emulation.setDeviceMetricsOverride", &size);
        let scheme = if is_dark { "dark" } else { "light" };
        let media = json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] });
        self.command("Emulation.setEmulatedMedia", &media);
    }

    /// Evaluates an expression of the page's language, and waits for its promise.
    ///
    /// # Panics
    /// If the expression throws.
    pub(crate) fn evaluate(&mut self, expression: &str) -> Value {
        let asked = json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
        let result = self.command("Runtime.evaluate", &asked);
        assert!(result["exceptionDetails"].is_null(), "{expression}: {result}");
        result["result"]["value"].clone()
    }

    /// Waits until an expression is true.
    ///
    /// # Panics
    /// If it does not become true in two minutes.
    pub(crate) fn wait_for(&mut self, expression: &str) {
        let start = Instant::now();
        while self.evaluate(expression) != json!(true) {
            let shown = self.evaluate("document.body?.innerText.slice(0, 2000)");
            assert!(start.elapsed() < DEADLINE, "{expression} does not become true: {shown}");
            sleep(Duration::from_millis(50));
        }
    }

    /// Presses a key.
    pub(crate) fn press(&mut self, key: &str, code: u32) {
        for kind in ["keyDown", "keyUp"] {
            let text = if key == "Enter" { "\r" } else { "" };
            let event = json!({ "type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code, "text": text });
            self.command("Input.dispatchKeyEvent", &event);
        }
    }

    /// Draws with the pressed pointer from one point to the other (px in the window).
    pub(crate) fn drag(&mut self, [from, to]: [[f64; 2]; 2]) {
        let mut pointer = |kind: &str, [x, y]: [f64; 2], buttons: u8| {
            let button = if kind == "mouseMoved" && buttons == 0 { "none" } else { "left" };
            let event = json!({ "type": kind, "x": x, "y": y, "button": button, "buttons": buttons, "clickCount": 1 });
            self.command("Input.dispatchMouseEvent", &event);
        };
        pointer("mouseMoved", from, 0);
        pointer("mousePressed", from, 1);
        for step in 1..=8 {
            let share = f64::from(step) / 8.0;
            pointer("mouseMoved", [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis])), 1);
        }
        pointer("mouseReleased", to, 0);
    }

    /// Returns the addresses that the page has asked for.
    pub(crate) fn requests(&mut self) -> Vec<String> {
        self.evaluate("1");
        let sent = self.events.iter().filter(|event| event["method"] == "Network.requestWillBeSent");
        sent.filter_map(|event| event["params"]["request"]["url"].as_str().map(str::to_owned)).collect()
    }

    /// Returns the errors of the page.
    pub(crate) fn errors(&mut self) -> Vec<String> {
        self.evaluate("1");
        let is_error = |event: &&Value| {
            event["method"] == "Runtime.exceptionThrown"
                || event["method"] == "Log.entryAdded" && event["params"]["entry"]["level"] == "error"
        };
        self.events.iter().filter(is_error).map(ToString::to_string).collect()
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        drop(self.browser.kill());
        drop(self.browser.wait());
    }
}
