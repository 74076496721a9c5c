//! A screen without a monitor, the program on it, and hands: Xvfb, xdotool and ImageMagick.

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use image::RgbImage;
use nephroid::viewer::panel::WIDTH;
use serde_json::Value;
use x11rb::connection::Connection as _;
use x11rb::protocol::xproto::{AtomEnum, ClientMessageEvent, ConnectionExt as _, EventMask};

use super::support::skip::skip;

/// Far longer than anything here takes; only a failing test waits for it.
const PATIENCE: Duration = Duration::from_secs(120);
/// Size of the screen and of the window [pixels].
pub const SIZE: (u32, u32) = (1280, 720);

/// Height of what the panel says between the button that bakes and its sections, at most: with what was refused and where
/// files were written [pixels].
const BELOW_BAKE: f64 = 160.0;

/// What the names of the buttons there begin with.
const ABOVE: [&str; 5] = ["Re-bake", "Cancel", "automatic", "Undo", "Redo"];

/// The folder that the program is started in, within the test's own.
const WORKING: &str = "working";

/// An X server of its own on a display number that was free.
pub struct Screen {
    server: Child,
    display: String,
}

impl Screen {
    /// `None`, loudly counted, where a tool is missing.
    pub fn start(test: &str) -> Option<Self> {
        for (tool, question) in [("Xvfb", "-help"), ("xdotool", "version"), ("import", "-version")] {
            let tried = Command::new(tool)
                .arg(question)
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .status();
            if tried.is_err() {
                skip(test, &format!("{tool} is not installed"));
                return None;
            }
        }
        let mut server = Command::new("Xvfb")
            .args([
                "-displayfd",
                "1",
                "-screen",
                "0",
                &format!("{}x{}x24", SIZE.0, SIZE.1),
                "-nolisten",
                "tcp",
            ])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb starts");
        let mut number = String::new();
        let output = server.stdout.as_mut().expect("it is piped");
        BufReader::new(output)
            .read_line(&mut number)
            .expect("Xvfb tells its display");
        let display = format!(":{}", number.trim());
        assert!(
            number.trim().parse::<u32>().is_ok(),
            "Xvfb gave no display: {number:?}"
        );
        Some(Self { server, display })
    }

    /// The title of a window on it.
    pub fn title_of(&self, viewer: &Viewer<'_>) -> String {
        self.xdotool(&["getwindowname", &viewer.window])
    }

    fn xdotool(&self, arguments: &[&str]) -> String {
        let output = Command::new("xdotool")
            .args(arguments)
            .env("DISPLAY", &self.display)
            .output();
        String::from_utf8(output.expect("xdotool runs").stdout).expect("xdotool writes text")
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// The program with its window open.
pub struct Viewer<'a> {
    screen: &'a Screen,
    program: Child,
    window: String,
    folder: tempfile::TempDir,
    /// Events that the test has read.
    read: usize,
}

impl<'a> Viewer<'a> {
    /// Starts `nephroid view` with these arguments and waits for its window.
    pub fn open(screen: &'a Screen, arguments: &[&str]) -> Self {
        Self::open_with(screen, arguments, None)
    }

    /// The same, with what was kept in a folder by another window; otherwise nothing was kept.
    pub fn open_with(screen: &'a Screen, arguments: &[&str], config: Option<&Path>) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let config = config.map_or_else(|| folder.path().join("config"), Path::to_path_buf);
        let stderr = fs::File::create(folder.path().join("stderr")).expect("a file");
        fs::create_dir(folder.path().join(WORKING)).expect("a folder");
        let program = Command::new(env!("CARGO_BIN_EXE_nephroid"))
            .arg("view")
            .args(arguments)
            .args(["--size", &format!("{}x{}", SIZE.0, SIZE.1), "--event-log"])
            .arg(folder.path().join("events"))
            .current_dir(folder.path().join(WORKING))
            .env("DISPLAY", &screen.display)
            .env("WINIT_X11_SCALE_FACTOR", "1")
            .env("NEPHROID_CONFIG_DIR", config)
            .env_remove("WAYLAND_DISPLAY")
            .stdout(Stdio::null())
            .stderr(stderr)
            .spawn()
            .expect("the program starts");
        let mut viewer = Self {
            screen,
            program,
            window: String::new(),
            folder,
            read: 0,
        };
        viewer.wait_for("started", |_| true);
        viewer.window = screen
            .xdotool(&["search", "--name", "Nephroid"])
            .trim()
            .to_owned();
        assert!(
            viewer.window.parse::<u32>().is_ok(),
            "one window: {:?}",
            viewer.window
        );
        viewer.xdotool(&["windowfocus", "--sync", &viewer.window]);
        viewer
    }

    fn xdotool(&self, arguments: &[&str]) {
        self.screen.xdotool(arguments);
    }

    /// Hands that do several things in a row.
    pub fn hands(&self, what: &str) {
        self.xdotool(&what.split_whitespace().collect::<Vec<_>>());
    }

    /// The window by its number.
    pub fn window(&self) -> &str {
        &self.window
    }

    /// Where the program was started.
    pub fn working_folder(&self) -> PathBuf {
        self.folder.path().join(WORKING)
    }

    fn events(&self) -> Vec<Value> {
        let text = fs::read_to_string(self.folder.path().join("events")).unwrap_or_default();
        // The last line may be half-written.
        let whole = text.rfind('\n').map_or("", |end| &text[..end]);
        whole
            .lines()
            .map(|line| serde_json::from_str(line).expect("a line is JSON"))
            .collect()
    }

    /// All events of that name so far.
    pub fn all(&self, name: &str) -> Vec<Value> {
        let mut events = self.events();
        events.retain(|event| event["event"] == name);
        events
    }

    /// The next event of that name that fits, after those that were waited for before.
    pub fn wait_for(&mut self, name: &str, fits: impl Fn(&Value) -> bool) -> Value {
        let start = Instant::now();
        loop {
            let events = self.events();
            let found = (self.read..events.len()).find(|&index| {
                let event = &events[index];
                event["event"] == name && fits(event)
            });
            if let Some(index) = found {
                self.read = index + 1;
                return events[index].clone();
            }
            let ended = self.program.try_wait().expect("it can be asked");
            assert!(
                ended.is_none(),
                "the program ended ({ended:?}): {}",
                self.stderr()
            );
            assert!(
                start.elapsed() < PATIENCE,
                "no {name} after {:#?}\n{}",
                events,
                self.stderr()
            );
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// The next maps that are shown, of a first level or, where that came too soon after it to be shown by itself, of the
    /// whole bake. They may be waited for again.
    pub fn wait_for_maps(&mut self) -> Value {
        let start = Instant::now();
        let is_shown = |event: &Value| event["event"] == "done" || event["shown"] == true;
        loop {
            let events = self.events();
            if let Some(maps) = events[self.read..].iter().find(|event| is_shown(event)) {
                return maps.clone();
            }
            assert!(
                start.elapsed() < PATIENCE,
                "no maps after {events:#?}\n{}",
                self.stderr()
            );
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Left, top, right and bottom of the first control of the panel that fits, by its role and name [pixels]; waits until
    /// it is there and rests.
    pub fn control(&self, what: &str, fits: impl Fn(&str, &str) -> bool) -> [f64; 4] {
        let start = Instant::now();
        let mut last = None;
        loop {
            let controls = self.all("controls").pop().unwrap_or_default();
            let text = |control: &Value, key: &str| control[key].as_str().unwrap_or_default().to_owned();
            let mut all = controls["controls"].as_array().into_iter().flatten();
            let found = all.find(|control| fits(&text(control, "role"), &text(control, "name")));
            let rect = found.map(|control| {
                let side = |side| control["rect_pixels"][side].as_f64().expect("a number");
                [0, 1, 2, 3].map(side)
            });
            match rect {
                Some(rect) if last == Some(rect) => return rect,
                _ => last = rect,
            }
            assert!(start.elapsed() < PATIENCE, "no {what} in {controls:#}");
            std::thread::sleep(Duration::from_millis(200));
        }
    }

    /// The middle of a control of the panel [pixels], scrolled into the window where it is not.
    pub fn centre(&self, role: &str, name: &str) -> (i32, i32) {
        let mut last_top = None;
        for _ in 0..20 {
            let [left, top, right, bottom] = self.control(name, |r, n| r == role && n == name);
            let [.., bake] = self.control("Re-bake", |_, name| name == "Re-bake");
            // What stands above the sections, or over the picture, does not scroll.
            let is_fixed = ABOVE.iter().any(|above| name.starts_with(above)) || left >= f64::from(WIDTH);
            let highest = if is_fixed { 0.0 } else { bake + BELOW_BAKE };
            // What stands at the very top cannot be scrolled any lower.
            let is_at_top = last_top == Some(top) && top > 0.0;
            if bottom < f64::from(SIZE.1) && (top > highest || is_at_top) {
                return ((0.5 * (left + right)) as i32, (0.5 * (top + bottom)) as i32);
            }
            last_top = Some(top);
            let wheel = if top > highest { 5 } else { 4 };
            // The panel glides, picture by picture, and pictures may take half a second.
            self.hands(&format!("mousemove 20 300 click {wheel} sleep 3"));
        }
        panic!("{role} {name} cannot be scrolled to");
    }

    /// A share of the way along a slider of the panel [pixels].
    pub fn on_slider(&self, name: &str, share: f64) -> (i32, i32) {
        let [left, top, _, bottom] = self.control(name, |r, n| r == "Slider" && n == name);
        ((left + 4.0 + share * 104.0) as i32, (0.5 * (top + bottom)) as i32)
    }

    /// Clicks a control of the panel as a person would, and leaves it.
    pub fn click(&self, role: &str, name: &str) {
        let (x, y) = self.centre(role, name);
        self.hands(&format!(
            "mousemove {x} {y} sleep 0.3 mousedown 1 sleep 0.3 mouseup 1 sleep 0.3 mousemove 900 300"
        ));
    }

    /// Types over what a field of the panel holds, and confirms.
    pub fn type_into(&self, role: &str, name: &str, text: &str) {
        let (x, y) = self.centre(role, name);
        self.hands(&format!(
            "mousemove {x} {y} sleep 0.3 click 1 sleep 0.3 key ctrl+a sleep 0.2"
        ));
        self.xdotool(&["type", "--delay", "20", text]);
        self.hands("sleep 0.3 key Return mousemove 900 300");
    }

    /// The display that its window is on.
    pub fn display(&self) -> &str {
        &self.screen.display
    }

    /// Forgets the events so far.
    pub fn forget(&mut self) {
        self.read = self.events().len();
    }

    /// What is on the screen.
    pub fn screenshot(&self) -> RgbImage {
        let path = self.folder.path().join("screen.png");
        let taken = Command::new("import")
            .args(["-window", "root", &format!("png24:{}", path.display())])
            .env("DISPLAY", &self.screen.display)
            .status();
        assert!(taken.expect("import runs").success(), "import took no picture");
        image::open(path).expect("it is a picture").to_rgb8()
    }

    /// Processor time of all its threads so far [s].
    pub fn cpu_s(&self) -> f64 {
        let stat = fs::read_to_string(format!("/proc/{}/stat", self.program.id())).expect("it runs");
        // Fields 14 and 15, counted after the name in parentheses, in ticks of 1/100 s.
        let fields: Vec<&str> = stat
            .rsplit(')')
            .next()
            .expect("a name")
            .split_whitespace()
            .collect();
        fields[11..13]
            .iter()
            .map(|ticks| ticks.parse::<f64>().expect("a number") / 100.0)
            .sum()
    }

    pub fn stderr(&self) -> String {
        let mut text = String::new();
        let file = fs::File::open(self.folder.path().join("stderr"));
        file.expect("it is there")
            .read_to_string(&mut text)
            .expect("it is text");
        text
    }

    /// Whether the program has not ended.
    pub fn runs(&mut self) -> bool {
        self.program.try_wait().expect("it can be asked").is_none()
    }

    /// Asks the window to close as a window manager does, and waits for the program's end.
    pub fn close(self) -> (ExitStatus, String) {
        let (status, stderr, _) = self.close_and_read();
        (status, stderr)
    }

    /// The same, with all events.
    pub fn close_and_read(mut self) -> (ExitStatus, String, Vec<Value>) {
        let (server, _) = x11rb::connect(Some(&self.screen.display)).expect("the server answers");
        let atom = |name: &str| {
            let asked = server.intern_atom(false, name.as_bytes()).expect("it is sent");
            asked.reply().expect("it is answered").atom
        };
        let window = self.window.parse().expect("a number");
        let data = [atom("WM_DELETE_WINDOW"), AtomEnum::NONE.into(), 0, 0, 0];
        let message = ClientMessageEvent::new(32, window, atom("WM_PROTOCOLS"), data);
        server
            .send_event(false, window, EventMask::NO_EVENT, message)
            .expect("it is sent");
        server.flush().expect("it is sent");
        self.wait_for("closing", |_| true);
        let status = self.wait_for_end();
        let stderr = self.stderr();
        (status, stderr, self.events())
    }

    /// Sends a signal by name and waits for the program's end.
    pub fn signal(mut self, name: &str) -> ExitStatus {
        let sent = Command::new("kill")
            .args(["-s", name, &self.program.id().to_string()])
            .status();
        assert!(sent.expect("kill runs").success());
        self.wait_for_end()
    }

    fn wait_for_end(&mut self) -> ExitStatus {
        let start = Instant::now();
        loop {
            if let Some(status) = self.program.try_wait().expect("it can be asked") {
                return status;
            }
            assert!(start.elapsed() < PATIENCE, "it does not end: {}", self.stderr());
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

impl Drop for Viewer<'_> {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}
