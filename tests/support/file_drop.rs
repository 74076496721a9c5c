//! A file manager that drops a file on a window: the source side of the X drag-and-drop protocol (XDND, version 5).

use std::path::Path;
use std::time::{Duration, Instant};

use x11rb::connection::Connection;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{
    Atom, AtomEnum, ClientMessageEvent, ConnectionExt as _, CreateWindowAux, EventMask, PropMode,
    SELECTION_NOTIFY_EVENT, SelectionNotifyEvent, SelectionRequestEvent, Window, WindowClass,
};
use x11rb::rust_connection::RustConnection;
use x11rb::wrapper::ConnectionExt as _;

const PATIENCE: Duration = Duration::from_secs(60);

struct Source {
    server: RustConnection,
    own: Window,
    target: Window,
    text: String,
}

/// Drags a file to the middle of a window, given by its display and number, and drops it there.
pub fn drop_file((display, target): (&str, &str), path: &Path) {
    let (server, screen) = x11rb::connect(Some(display)).expect("the server answers");
    let own = server.generate_id().expect("a number");
    let root = server.setup().roots[screen].root;
    let aux = CreateWindowAux::new();
    server
        .create_window(0, own, root, 0, 0, 1, 1, 0, WindowClass::INPUT_ONLY, 0, &aux)
        .expect("it is sent");
    let target = target.parse().expect("a number");
    let text = format!("file://{}\r\n", path.display());
    Source {
        server,
        own,
        target,
        text,
    }
    .run();
}

impl Source {
    fn atom(&self, name: &str) -> Atom {
        let asked = self.server.intern_atom(false, name.as_bytes());
        asked.expect("it is sent").reply().expect("it is answered").atom
    }

    fn send(&self, to: Window, message: impl Into<[u8; 32]>) {
        let sent = self.server.send_event(false, to, EventMask::NO_EVENT, message);
        sent.expect("it is sent");
        self.server.flush().expect("it is sent");
    }

    fn tell(&self, message: &str, [a, b, c, d]: [u32; 4]) {
        let data = [self.own, a, b, c, d];
        self.send(
            self.target,
            ClientMessageEvent::new(32, self.target, self.atom(message), data),
        );
    }

    fn run(&self) {
        let (list, selection) = (self.atom("text/uri-list"), self.atom("XdndSelection"));
        let owner = self
            .server
            .set_selection_owner(self.own, selection, x11rb::CURRENT_TIME);
        owner.expect("it is sent");
        self.tell("XdndEnter", [5 << 24, list, 0, 0]);
        let copy = self.atom("XdndActionCopy");
        self.tell("XdndPosition", [0, (800 << 16) | 400, x11rb::CURRENT_TIME, copy]);
        // The window asks for the path and accepts it.
        self.answer_until("XdndStatus", true);
        self.tell("XdndDrop", [0, x11rb::CURRENT_TIME, 0, 0]);
        self.answer_until("XdndFinished", false);
    }

    /// Serves the path until the window has sent that message and, with `must_ask`, has asked for the path.
    fn answer_until(&self, message: &str, mut must_ask: bool) {
        let awaited = self.atom(message);
        let mut must_tell = true;
        let start = Instant::now();
        while must_ask || must_tell {
            match self.server.poll_for_event().expect("the server answers") {
                Some(Event::SelectionRequest(request)) => {
                    self.hand_out(&request);
                    must_ask = false;
                }
                Some(Event::ClientMessage(event)) => must_tell &= event.type_ != awaited,
                Some(_) => {}
                None => std::thread::sleep(Duration::from_millis(10)),
            }
            assert!(
                start.elapsed() < PATIENCE,
                "the window does not answer {message:?}"
            );
        }
    }

    fn hand_out(&self, request: &SelectionRequestEvent) {
        let (to, target) = (request.requestor, request.target);
        let text = self.text.as_bytes();
        let changed = self
            .server
            .change_property8(PropMode::REPLACE, to, request.property, target, text);
        changed.expect("it is sent");
        let has_property = request.property != u32::from(AtomEnum::NONE);
        let notice = SelectionNotifyEvent {
            response_type: SELECTION_NOTIFY_EVENT,
            sequence: 0,
            time: request.time,
            requestor: to,
            selection: request.selection,
            target,
            property: if has_property { request.property } else { target },
        };
        self.send(to, notice);
    }
}
