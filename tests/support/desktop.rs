//! A virtual screen, the program on it, and simulated input: Xvfb, xdotool and ImageMagick.

use std::cell::Cell;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use image::RgbImage;
use nephroid::viewer::navigation::Navigator;
use nephroid::viewer::panel::WIDTH;
use x11rb::connection::Connection as _;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{
    ChangeWindowAttributesAux, ClientMessageEvent, ConnectionExt as _, EventMask,
};
use x11rb::rust_connection::RustConnection;

use crate::prelude::*;
use crate::keep_bytes;
use crate::program::program;
use crate::skip;
use crate::tools::builtin_scene;

/// Timeout far above what anything here takes; only a failing test reaches it.
const PATIENCE: Duration = Duration::from_secs(300);

/// Size of the screen and of the window [pixels].
pub const SIZE: (u32, u32) = (1280, 720);

/// Fraction of the pixels that may differ visibly between two pictures of the same view at rest. Each picture is the
/// mean of as many samples as time allowed, which shows at edges seen in mirrors.
pub const ALIKE: f64 = 0.005;

/// [`wait_until`] with a message computed at the timeout.
#[track_caller]
fn poll<T>(what: &dyn Fn() -> String, mut ask: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(answer) = ask() {
            return answer;
        }
        assert!(start.elapsed() < PATIENCE, "{}", what());
        std::thread::sleep(Duration::from_millis(50));
    }
}

/// Polls until there is an answer; fails at the timeout.
#[track_caller]
pub fn wait_until<T>(what: &str, ask: impl FnMut() -> Option<T>) -> T {
    poll(&|| format!("never: {what}"), ask)
}

/// An X server of its own on a free display.
pub struct Screen {
    server: Child,
    display: String,
}

impl Screen {
    /// If a tool is missing, counts a skip and returns `None`.
    pub fn start() -> Option<Self> {
        for (tool, question) in [("Xvfb", "-help"), ("xdotool", "version"), ("import", "-version")] {
            let mut command = Command::new(tool);
            command.arg(question).stdout(Stdio::null()).stderr(Stdio::null());
            if command.status().is_err() {
                let test = std::thread::current().name().unwrap_or("?").to_owned();
                skip(&test, &format!("{tool} is not installed"));
                return None;
            }
        }
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-nolisten", "tcp", "-screen", "0"])
            .arg(format!("{}x{}x24", SIZE.0, SIZE.1))
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb starts");
        let mut number = String::new();
        let output = server.stdout.as_mut().expect("it is piped");
        BufReader::new(output)
            .read_line(&mut number)
            .expect("Xvfb tells its display");
        let number: u32 = number.trim().parse().expect("a display number");
        let display = format!(":{number}");
        Some(Self { server, display })
    }

    fn xdotool(&self, arguments: &[&str]) -> String {
        let mut command = Command::new("xdotool");
        let output = command.args(arguments).env("DISPLAY", &self.display).output();
        String::from_utf8(output.expect("xdotool runs").stdout).expect("xdotool writes text")
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// A minimal window manager.
struct Manager {
    server: RustConnection,
    pings: Cell<u32>,
}

impl Manager {
    fn new(display: &str) -> Self {
        let (server, screen) = x11rb::connect(Some(display)).expect("the server answers");
        // Replies to pings go to the root window.
        let aux = ChangeWindowAttributesAux::new().event_mask(EventMask::SUBSTRUCTURE_NOTIFY);
        let root = server.setup().roots[screen].root;
        let asked = server.change_window_attributes(root, &aux).expect("it is sent");
        asked.check().expect("it is granted");
        let pings = Cell::new(0);
        Self { server, pings }
    }

    fn atom(&self, name: &str) -> u32 {
        let asked = self.server.intern_atom(false, name.as_bytes());
        asked.expect("it is sent").reply().expect("it is answered").atom
    }

    fn say(&self, window: u32, [what, a, b]: [u32; 3]) {
        let message = ClientMessageEvent::new(32, window, self.atom("WM_PROTOCOLS"), [what, a, b, 0, 0]);
        let sent = self.server.send_event(false, window, EventMask::NO_EVENT, message);
        sent.expect("it is sent").check().expect("the window is there");
    }

    /// Pings the window and waits for the reply: by then it has received all earlier events.
    fn ping(&self, window: u32) {
        let (number, ping) = (self.pings.get() + 1, self.atom("_NET_WM_PING"));
        self.pings.set(number);
        self.say(window, [ping, number, window]);
        let start = Instant::now();
        loop {
            match self.server.poll_for_event().expect("the server answers") {
                Some(Event::ClientMessage(answer)) if answer.data.as_data32()[..2] == [ping, number] => break,
                Some(_) => {}
                None => std::thread::sleep(Duration::from_millis(5)),
            }
            assert!(start.elapsed() < PATIENCE, "the window does not answer");
        }
    }
}

/// The program with its window open.
pub struct Viewer<'a> {
    screen: &'a Screen,
    manager: Manager,
    program: Child,
    window: String,
    folder: tempfile::TempDir,
    /// Number of events that the test has consumed.
    read: usize,
    /// Whether the left mouse button is down.
    pulls: bool,
}

impl<'a> Viewer<'a> {
    /// Starts `nephroid view` with arguments separated by spaces, and waits for its window.
    pub fn open(screen: &'a Screen, arguments: &str) -> Self {
        Self::open_with(screen, arguments, None)
    }

    /// The same with a configuration folder; `None` starts with an empty one.
    pub fn open_with(screen: &'a Screen, arguments: &str, config: Option<&Path>) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let config = config.map_or_else(|| folder.path().join("config"), Path::to_path_buf);
        let stderr = fs::File::create(folder.path().join("stderr")).expect("a file");
        fs::create_dir(folder.path().join("working")).expect("a folder");
        let program = Command::new(program())
            .arg("view")
            .args(arguments.split_whitespace())
            .args(["--size", &format!("{}x{}", SIZE.0, SIZE.1), "--event-log"])
            .arg(folder.path().join("events"))
            .current_dir(folder.path().join("working"))
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
            manager: Manager::new(&screen.display),
            program,
            window: String::new(),
            folder,
            read: 0,
            pulls: false,
        };
        viewer.wait_for("started", |_| true);
        viewer.window = screen
            .xdotool(&["search", "--name", "Nephroid"])
            .trim()
            .to_owned();
        viewer.hands(&format!("windowfocus --sync {}", viewer.window));
        viewer
    }

    fn number(&self) -> u32 {
        let number = self.window.parse();
        number.unwrap_or_else(|_| panic!("one window: {:?}", self.window))
    }

    /// Sends input in xdotool's syntax without waiting.
    pub fn hasty_hands(&self, what: &str) {
        self.screen.xdotool(&what.split_whitespace().collect::<Vec<_>>());
    }

    /// Sends input and waits until the window has drawn its effect. A slow window would otherwise receive several
    /// inputs at once, and a click at the latest position of the mouse.
    pub fn hands(&self, what: &str) {
        self.hasty_hands(what);
        // The window answers each ping before it draws a frame. The second answer comes after the frame that handled
        // the input, the third after the frame which that one requested.
        for _ in 0..3 {
            std::thread::sleep(Duration::from_millis(20));
            self.manager.ping(self.number());
        }
    }

    /// Holds a key for a time [s].
    pub fn hold(&self, key: &str, seconds: f64) {
        self.hands(&format!("keydown {key}"));
        std::thread::sleep(Duration::from_secs_f64(seconds));
        self.hands(&format!("keyup {key}"));
    }

    /// Display and number of the window.
    pub fn place(&self) -> (&str, &str) {
        (&self.screen.display, &self.window)
    }

    pub fn title(&self) -> String {
        self.screen.xdotool(&["getwindowname", &self.window])
    }

    /// Working folder of the program.
    pub fn working_folder(&self) -> PathBuf {
        self.folder.path().join("working")
    }

    pub fn stderr(&self) -> String {
        fs::read_to_string(self.folder.path().join("stderr")).expect("it is text")
    }

    /// Complete lines of the event log; the last line may still be in writing.
    fn log(&self) -> String {
        let mut text = fs::read_to_string(self.folder.path().join("events")).unwrap_or_default();
        text.truncate(text.rfind('\n').map_or(0, |end| end + 1));
        text
    }

    /// All events of that name so far.
    pub fn all(&self, name: &str) -> Vec<Value> {
        let start = format!("{{\"event\":\"{name}\"");
        let log = self.log();
        log.lines()
            .filter(|line| line.starts_with(&start))
            .map(event)
            .collect()
    }

    /// Skips the events so far.
    pub fn forget(&mut self) {
        self.read = self.log().lines().count();
    }

    /// Index and content of the next event that fits.
    fn next(&mut self, what: &str, fits: impl Fn(&Value) -> bool) -> (usize, Value) {
        let (path, read) = (self.folder.path().join("events"), self.read);
        let told = || format!("no {what}: {}", fs::read_to_string(&path).unwrap_or_default());
        poll(&told, || {
            let has_ended = !self.runs();
            let log = self.log();
            let mut events = log
                .lines()
                .enumerate()
                .skip(read)
                .map(|(index, line)| (index, event(line)));
            let found = events.find(|(_, event)| fits(event));
            let is_well = found.is_some() || !has_ended;
            assert!(is_well, "it ended without {what}: {}", self.stderr());
            found
        })
    }

    /// The next event of that name that fits, after the last one waited for.
    pub fn wait_for(&mut self, name: &str, fits: impl Fn(&Value) -> bool) -> Value {
        let (index, event) = self.next(name, |event| event["event"] == name && fits(event));
        self.read = index + 1;
        event
    }

    /// Waits for the end of the bake and the idle window that follows.
    pub fn wait_for_bake(&mut self) -> (Value, Value) {
        (self.wait_for("done", |_| true), self.wait_for("rest", |_| true))
    }

    /// Moves the camera by a key for half a second; returns the position where it comes to rest.
    pub fn fly(&mut self, key: &str, from: DVec3) -> DVec3 {
        self.hands("mousemove 900 300");
        self.forget();
        self.hold(key, 0.5);
        self.wait_for_move(from)
    }

    /// Waits until the camera rests at another position; returns it.
    pub fn wait_for_move(&mut self, from: DVec3) -> DVec3 {
        position(&self.wait_for("rest", |rest| position(rest).distance(from) > 1e-6))
    }

    /// Present controls: role, name, and left, top, right and bottom [pixels].
    fn controls(&self) -> Vec<(String, String, [f64; 4])> {
        let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
        let known = self.all("controls").pop();
        let all = known.iter().flat_map(|event| event["controls"].as_array());
        all.flatten()
            .map(|control| {
                let side = |side: usize| control["rect_pixels"][side].as_f64().expect("a number");
                (text(&control["role"]), text(&control["name"]), [0, 1, 2, 3].map(side))
            })
            .collect()
    }

    /// Left, top, right and bottom of the first control of that role and name [pixels]. Waits until it exists and does not
    /// move.
    fn control(&self, role: &str, name: &str) -> [f64; 4] {
        let mut last = None;
        poll(&|| format!("no {name} in {:?}", self.controls()), || {
            let mut all = self.controls().into_iter();
            let found = all.find(|(r, n, _)| r == role && n == name);
            let rect = found.map(|(.., rect)| rect);
            if rect.is_some() && last == rect {
                return last;
            }
            last = rect;
            // A scrolling panel moves with every picture, and pictures may take half a second.
            self.hands("sleep 0.1");
            None
        })
    }

    /// Positions on a slider, by fractions of its length [pixels].
    pub fn on_slider<const N: usize>(&self, name: &str, shares: [f64; N]) -> [(i32, i32); N] {
        let [left, top, _, bottom] = self.control("Slider", name);
        shares.map(|share| ((left + 4.0 + share * 104.0) as i32, (0.5 * (top + bottom)) as i32))
    }

    /// Clicks at a position [pixels].
    fn click_at(&self, (x, y): (i32, i32)) {
        self.hands(&format!("mousemove {x} {y}"));
        self.hands("mousedown 1");
        self.hands("mouseup 1");
    }

    /// Clicks a control of the panel, after scrolling down to it.
    pub fn click(&self, role: &str, name: &str) {
        for _ in 0..60 {
            let [left, top, right, bottom] = self.control(role, name);
            if bottom < f64::from(SIZE.1) {
                return self.click_at(((0.5 * (left + right)) as i32, (0.5 * (top + bottom)) as i32));
            }
            self.hands("mousemove 20 300");
            self.hands("click 5");
        }
        panic!("{role} {name} cannot be scrolled to");
    }

    /// Presses the mouse at the first position and drags to the others [pixels]; it stays pressed.
    pub fn pull(&mut self, places: &[(i32, i32)]) {
        self.forget();
        self.pulls = true;
        for (index, (x, y)) in places.iter().enumerate() {
            self.hands(&format!("mousemove {x} {y}"));
            if index == 0 {
                self.hands("mousedown 1");
            }
        }
    }

    /// Releases the mouse.
    pub fn let_go(&mut self) {
        self.hands("mouseup 1");
        self.pulls = false;
    }

    /// A screenshot. Unless the mouse is pressed, it is first moved away from the panel, to hide tooltips.
    pub fn screenshot(&self) -> RgbImage {
        if !self.pulls {
            self.hands("mousemove 900 300");
        }
        let path = self.folder.path().join("screen.png");
        let taken = Command::new("import")
            .args(["-window", "root", &format!("png24:{}", path.display())])
            .env("DISPLAY", &self.screen.display)
            .status();
        assert!(taken.expect("import runs").success(), "import took no picture");
        image::open(path).expect("it is a picture").to_rgb8()
    }

    /// The first screenshot that fits; what the log reports takes a moment to reach the screen.
    #[track_caller]
    pub fn screenshot_that(&self, what: &str, fits: impl Fn(&RgbImage) -> bool) -> RgbImage {
        let keep = || {
            let png = fs::read(self.folder.path().join("screen.png")).unwrap_or_default();
            format!("no picture {what}; {}", keep_bytes("screen.png", &png))
        };
        poll(&keep, || Some(self.screenshot()).filter(&fits))
    }

    /// CPU time of all threads so far [s].
    pub fn cpu_s(&self) -> f64 {
        let stat = fs::read_to_string(format!("/proc/{}/stat", self.program.id())).expect("it runs");
        // Fields 14 and 15, counted from the end of the name in parentheses, in ticks of 1/100 s.
        let after_name = stat.rsplit(')').next().expect("a name");
        let ticks = after_name.split_whitespace().skip(11).take(2);
        ticks
            .map(|ticks| ticks.parse::<f64>().expect("a number") / 100.0)
            .sum()
    }

    /// Whether the program is still running.
    pub fn runs(&mut self) -> bool {
        self.program.try_wait().expect("it can be asked").is_none()
    }

    /// Closes the window as a window manager does. Asserts that the program ends with success and without a panic;
    /// returns its stderr and all events.
    #[track_caller]
    pub fn close(self) -> (String, Vec<Value>) {
        let close = self.manager.atom("WM_DELETE_WINDOW");
        self.manager.say(self.number(), [close, 0, 0]);
        self.ended()
    }

    /// Destroys the window as another program can; otherwise as [`close`](Self::close).
    pub fn destroy(self) -> (String, Vec<Value>) {
        self.hasty_hands(&format!("windowclose {}", self.window));
        self.ended()
    }

    fn ended(mut self) -> (String, Vec<Value>) {
        self.wait_for("closing", |_| true);
        let status = self.wait_for_end();
        let stderr = self.stderr();
        assert_eq!(status.code(), Some(0), "{stderr}");
        assert!(!stderr.contains("panicked"), "{stderr}");
        (stderr, self.log().lines().map(event).collect())
    }

    /// Sends a signal by name and waits for the program to end.
    pub fn signal(mut self, name: &str) -> ExitStatus {
        let id = self.program.id().to_string();
        let sent = Command::new("kill").args(["-s", name, &id]).status();
        assert!(sent.expect("kill runs").success());
        self.wait_for_end()
    }

    fn wait_for_end(&mut self) -> ExitStatus {
        poll(&|| "it does not end".to_owned(), || {
            self.program.try_wait().expect("it can be asked")
        })
    }
}

impl Drop for Viewer<'_> {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

/// Parses a line of the event log.
fn event(line: &str) -> Value {
    serde_json::from_str(line).expect("a line is JSON")
}

/// Position of the camera in an event [m].
pub fn position(rest: &Value) -> DVec3 {
    let coordinate = |axis: usize| rest["position_m"][axis].as_f64().expect("a number");
    dvec3(coordinate(0), coordinate(1), coordinate(2))
}

/// Window position of a point in the initial view of a built-in scene [pixels].
pub fn pixel_of(scene: &str, point: DVec3) -> (i32, i32) {
    let (left, height) = (f64::from(WIDTH), f64::from(SIZE.1));
    let width = f64::from(SIZE.0) - left;
    let camera = Navigator::new(&builtin_scene(scene), None).camera_for(width / height);
    let d = point - camera.position;
    let scale = 0.5 * height / (0.5 * camera.vertical_fov_rad).tan() / d.dot(camera.forward);
    let x = left + 0.5 * width + scale * d.dot(camera.right());
    let y = 0.5 * height - scale * d.dot(camera.up);
    (x as i32, y as i32)
}

/// Pixels of the picture with their positions, without the panel.
pub fn picture(shot: &RgbImage) -> impl Iterator<Item = (u32, u32, [u8; 3])> {
    let pixels = shot.enumerate_pixels().map(|(x, y, pixel)| (x, y, pixel.0));
    pixels.filter(|(x, ..)| *x >= WIDTH as u32)
}

/// Fraction of the picture's pixels that differ visibly.
pub fn difference(a: &RgbImage, b: &RgbImage) -> f64 {
    let differs = |p: [u8; 3], q: [u8; 3]| p.iter().zip(q).any(|(p, q)| p.abs_diff(q) > 8);
    let pairs = picture(a).zip(picture(b));
    let count = pairs.filter(|((.., p), (.., q))| differs(*p, *q)).count();
    count as f64 / picture(a).count() as f64
}
