//! The server of `anim preview`, asked as its page asks it.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};

use serde_json::{Value, json};

use crate::tool::Sandbox;

const STAGE: &str = "(
    camera: (from: (0.0, 1.0, 5.0), at: (0.0, 0.5, 0.0)),
    render: (size: (48, 27), samples: 4, integrator: Distribution),
    materials: { \"brass\": (color: (0.9, 0.7, 0.4)), \"slate\": (color: (0.2, 0.3, 0.4)) },
    entities: [
        (name: \"ball\", sphere: (radius: 1.0), material: \"brass\"),
        (name: \"cube\", aabox: (min: (1.2, 0.0, -1.0), max: (2.0, 0.8, 0.0)), material: \"slate\"),
        (name: \"floor\", plane: ()),
        (name: \"key\", area_light: (size: (1.0, 1.0)), transform: (translation: (3.0, 4.0, 2.0))),
    ],
)
";

/// A preview that runs, ended when dropped.
struct Preview {
    child: Child,
    port: u16,
    token: String,
}

impl Drop for Preview {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

struct Answer {
    status: u16,
    body: Vec<u8>,
}

impl Preview {
    fn of(sandbox: &Sandbox, input: &str) -> Preview {
        let mut child = Command::new(env!("CARGO_BIN_EXE_anim"))
            .args(["preview", input])
            .current_dir(sandbox.path(""))
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let rest = line.trim().strip_prefix("http://127.0.0.1:").unwrap();
        let (port, token) = rest.split_once("/?token=").unwrap();
        Preview { child, port: port.parse().unwrap(), token: token.into() }
    }

    fn send(&self, method: &str, path: &str, headers: &[(&str, &str)], body: &[u8]) -> Answer {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        let mut head = format!("{method} {path} HTTP/1.1\r\nConnection: close\r\nContent-Length: {}\r\n", body.len());
        headers.iter().for_each(|(name, value)| head += &format!("{name}: {value}\r\n"));
        stream.write_all(format!("{head}\r\n").as_bytes()).unwrap();
        // A body that is too long may be refused before it is read.
        let _ = stream.write_all(body);
        let mut answer = Vec::new();
        let _ = stream.read_to_end(&mut answer);
        let end = answer.windows(4).position(|four| four == b"\r\n\r\n").unwrap();
        let head = String::from_utf8_lossy(&answer[..end]).into_owned();
        assert!(!head.to_lowercase().contains("transfer-encoding"), "{head}");
        Answer { status: head.split(' ').nth(1).unwrap().parse().unwrap(), body: answer[end + 4..].to_vec() }
    }

    fn own_headers(&self) -> [(&'static str, String); 2] {
        [("Host", format!("127.0.0.1:{}", self.port)), ("X-Anim-Token", self.token.clone())]
    }

    fn get(&self, path: &str) -> Answer {
        let [host, token] = self.own_headers();
        self.send("GET", path, &[(host.0, &host.1), (token.0, &token.1)], b"")
    }

    fn post(&self, path: &str, message: Value) -> Answer {
        let [host, token] = self.own_headers();
        self.send("POST", path, &[(host.0, &host.1), (token.0, &token.1)], message.to_string().as_bytes())
    }

    /// The state once it is as wanted.
    #[track_caller]
    fn wait_for(&self, what: &str, is: impl Fn(&Value) -> bool) -> Value {
        let mut since = 0;
        for _ in 0..400 {
            let state: Value = serde_json::from_slice(&self.get(&format!("/state?since={since}")).body).unwrap();
            if is(&state) {
                return state;
            }
            since = state["version"].as_u64().unwrap();
        }
        panic!("{what} does not come about");
    }

    /// The file of the exact picture that is shown once everything that was done so far is seen.
    #[track_caller]
    fn exact(&self, revision: u64) -> Vec<u8> {
        let state = self.wait_for("an exact picture", |state| {
            state["revision"].as_u64() >= Some(revision)
                && state["current"]["kind"] == "exact"
                && state["current"]["has_file"] == true
                && state["target"].is_string()
        });
        let bytes = self.get(&format!("/file/{}", state["current"]["picture"])).body;
        assert!(bytes.starts_with(b"\x89PNG"));
        bytes
    }

    fn revision(&self) -> u64 {
        let state: Value = serde_json::from_slice(&self.get("/state?since=0").body).unwrap();
        state["revision"].as_u64().unwrap_or(0)
    }
}

fn fresh(scene: &[u8]) -> Vec<u8> {
    let sandbox = Sandbox::new();
    sandbox.write("a.ron", scene).anim("a.ron").ok();
    sandbox.read("frames/a.png")
}

#[test]
fn only_its_user_gets_in() {
    let sandbox = Sandbox::new();
    sandbox.write("a.ron", STAGE);
    let preview = Preview::of(&sandbox, "a.ron");
    let host = format!("127.0.0.1:{}", preview.port);
    let own = ("Host", host.as_str());
    let token = ("X-Anim-Token", preview.token.as_str());
    let origin = format!("http://{host}");
    let get = |headers: &[(&str, &str)]| preview.send("GET", "/", headers, b"").status;
    assert_eq!(get(&[own, token]), 200);
    assert_eq!(get(&[own, token, ("Origin", &origin)]), 200);
    assert_eq!(preview.send("GET", &format!("/?token={}", preview.token), &[own], b"").status, 200);
    assert_eq!(get(&[own]), 403);
    assert_eq!(get(&[own, ("X-Anim-Token", "0000")]), 403);
    assert_eq!(get(&[("Host", "evil.example"), token]), 403);
    assert_eq!(get(&[own, token, ("Origin", "http://evil.example")]), 403);
    assert_eq!(get(&[own, token, ("Sec-Fetch-Site", "cross-site")]), 403);
    let long = vec![b' '; 1 << 20];
    assert_eq!(preview.send("POST", "/set", &[own, token], &long).status, 413);
    for path in ["/set", "/try", "/look", "/define"] {
        assert_eq!(preview.post(path, json!("x")).status, 400, "{path}");
    }
    for path in ["/../a.ron", "/a.ron", "/golden/1", "/picture/99", "/file/x"] {
        assert_eq!(preview.get(path).status, 404, "{path}");
    }
    assert_eq!(sandbox.read("a.ron"), STAGE.as_bytes());
    let page = String::from_utf8(preview.get("/").body).unwrap();
    assert!(!page.contains("https://") && !page.contains("src=\"http"));
}

#[test]
fn edits_mistakes_and_mends_are_followed_to_the_exact_picture() {
    let sandbox = Sandbox::new();
    sandbox.write("a.ron", STAGE);
    let preview = Preview::of(&sandbox, "a.ron");
    assert_eq!(preview.exact(0), fresh(STAGE.as_bytes()));
    // Saved by an editor; then broken, which lies over the last picture; then mended.
    let painted = STAGE.replace("(0.9, 0.7, 0.4)", "(0.2, 0.9, 0.3)");
    let revision = preview.revision();
    sandbox.write("a.ron", &painted);
    assert_eq!(preview.exact(revision + 1), fresh(painted.as_bytes()));
    sandbox.write("a.ron", painted.replace("sphere", "sphree"));
    let broken = preview.wait_for("a mistake", |state| state["problems"].as_array().is_some_and(|all| !all.is_empty()));
    assert_eq!((&broken["problems"][0]["line"], &broken["problems"][0]["file"]), (&json!(6), &json!("a.ron")));
    assert!(broken["problems"][0]["help"].as_str().unwrap().contains("`sphere`"));
    assert_eq!(preview.get(&format!("/picture/{}", broken["current"]["picture"])).status, 200);
    sandbox.write("a.ron", STAGE);
    preview.wait_for("mended", |state| state["problems"] == json!([]));
    assert_eq!(preview.exact(0), fresh(STAGE.as_bytes()));
    // From the page: tried out, written at its place, taken back.
    let moved = json!({ "subject": { "kind": "entity", "index": 0 }, "component": "transform", "field": "translation", "value": [0, 1, 0] });
    let seen = preview.wait_for("a picture", |_| true)["current"]["picture"].clone();
    assert_eq!(preview.post("/try", json!([moved])).status, 200);
    preview.wait_for("what was tried", |state| {
        state["current"]["kind"] == "sketch" && state["current"]["picture"] != seen
    });
    let revision = preview.revision();
    let set = json!([{ "path": "entities.ball.transform.translation", "value": "(0.0, 1.0, 0.0)" }]);
    assert_eq!(preview.post("/set", set).status, 200);
    let after = String::from_utf8(sandbox.read("a.ron")).unwrap();
    assert_eq!(
        after,
        STAGE.replace("material: \"brass\")", "material: \"brass\", transform: (translation: (0.0, 1.0, 0.0)))")
    );
    assert_eq!(preview.exact(revision + 1), fresh(after.as_bytes()));
    let wrong = preview.post("/set", json!([{ "path": "camera.fov", "value": "500" }]));
    assert!(wrong.status == 409 && String::from_utf8_lossy(&wrong.body).contains("`fov` must be from"));
    assert_eq!(preview.post("/undo", json!({})).status, 200);
    assert_eq!(sandbox.read("a.ron"), STAGE.as_bytes());
    assert_eq!(preview.exact(revision + 2), fresh(STAGE.as_bytes()));
}

#[test]
fn a_pixel_knows_its_entity_and_a_field_its_line() {
    let sandbox = Sandbox::new();
    sandbox.write("a.ron", STAGE);
    let preview = Preview::of(&sandbox, "a.ron");
    preview.exact(0);
    let layers = preview.get("/layers").body;
    let word = |i: usize| u32::from_le_bytes(layers[4 * i..4 * i + 4].try_into().unwrap());
    let (width, height) = (word(0) as usize, word(1) as usize);
    assert_eq!(layers.len(), 8 + 36 * width * height);
    let entity = |x: usize, y: usize| word(2 + y * width + x);
    assert_eq!((width, height, entity(24, 13), entity(24, 26), entity(0, 0)), (48, 27, 1, 3, 0));
    let depth = f32::from_bits(word(2 + 2 * width * height + 13 * width + 24));
    assert!((depth - 4.0).abs() < 0.4, "{depth}");
    let part: Value = serde_json::from_slice(&preview.get("/part?kind=entity&index=0").body).unwrap();
    assert_eq!((part["label"].as_str(), part["movable"].as_bool()), (Some("entity `ball`"), Some(true)));
    let fields = part["groups"][0]["fields"].as_array().unwrap();
    let radius = fields.iter().find(|field| field["name"] == "radius").unwrap();
    assert_eq!((&radius["line"], &radius["writable"], &radius["value"]), (&json!(6), &json!(true), &json!(1.0)));
    assert_eq!(preview.get("/part?kind=entity&index=99").status, 409);
}

#[test]
fn random_edits_in_a_row_end_in_the_picture_of_a_fresh_render() {
    let sandbox = Sandbox::new();
    sandbox.write("a.ron", STAGE);
    let preview = Preview::of(&sandbox, "a.ron");
    preview.exact(0);
    let mut seed = 7_u64;
    let mut next = |below: u64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) % below
    };
    let mut text = STAGE.to_string();
    for edit in 0..40 {
        let [a, b] = [next(90) + 10, next(90) + 10];
        text = match next(6) {
            0 => text.replace("(0.2, 0.3, 0.4)", &format!("(0.2, 0.{a}, 0.4)")),
            1 => STAGE.replace("(0.9, 0.7, 0.4)", &format!("(0.{b}, 0.7, 0.4)")),
            2 => STAGE.replace("radius: 1.0", &format!("radius: 0.{a}")),
            3 => STAGE.replace("(1.2, 0.0, -1.0)", &format!("(1.{}, 0.0, -1.0)", a % 10)),
            4 => STAGE.replace("(3.0, 4.0, 2.0)", &format!("(3.{a}, 4.0, 2.0)")),
            _ => STAGE.replace("(0.0, 1.0, 5.0)", &format!("(0.{b}, 1.0, 5.0)")),
        };
        match next(5) {
            0 => drop(sandbox.write("a.ron", &text[..(next(text.len() as u64)) as usize])),
            1 => drop(sandbox.write("a.ron", text.replacen("radius", "radios", 1))),
            _ => {}
        }
        sandbox.write("a.ron", &text);
        std::thread::sleep(std::time::Duration::from_millis(next(60)));
        if edit % 10 == 9 {
            // Silence, so that the last edit has been heard of.
            std::thread::sleep(std::time::Duration::from_millis(400));
            preview.wait_for("mended", |state| state["problems"] == json!([]));
            assert_eq!(preview.exact(0), fresh(text.as_bytes()), "after edit {edit}:\n{text}");
        }
    }
}
