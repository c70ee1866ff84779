//! What is asked and answered: the page, news, pictures, orders.
//!
//! | request | |
//! |---|---|
//! | `GET /` | the page |
//! | `GET /state?since=N` | what there is to be seen, once it is newer than version N; at the latest after half a minute |
//! | `GET /picture/ID` | width, height, then RGB in 8 bits |
//! | `GET /linear/ID` | the same in linear floats, of the pictures that were made last |
//! | `GET /file/ID` | a PNG; of an exact picture the bytes that `anim render` writes |
//! | `GET /golden/FRAME` | the golden frame of the project |
//! | `GET /layers` | what the pixels of the frame show |
//! | `GET /noise` | how many samples they have, and how noisy they are |
//! | `GET /part?kind=entity&index=N` | fields of a part of the scene |
//! | `POST /look /define /try /set /undo /render` | orders, as JSON |

use std::sync::Arc;
use std::time::Duration;

use axum::Router;
use axum::body::{Body, Bytes, to_bytes};
use axum::extract::{Request, State};
use axum::http::header::{self, HeaderMap, HeaderValue};
use axum::http::{Method, StatusCode, Uri};
use axum::response::Response;
use serde_json::{Value, json};
use tokio::sync::oneshot;

use super::PreviewOptions;
use super::board::{Board, Order, PagePart, PageReplyBytes, Trial};
use super::guard::{AccessToken, Credentials, Refusal, admit};
use super::page::PAGE;
use super::watching::FileWatch;
use super::worker::PreviewWorker;
use crate::base::diagnostics::{Cause, Diagnostic};
use crate::base::{files, limits};
use crate::load::ron::edit::Assignment;
use crate::output::{PngPixels, encode_small_png};

/// News are waited for so long; then a page asks again, which tells it that the server is alive.
const PATIENCE: Duration = Duration::from_secs(25);

/// What requests are answered from.
struct Desk {
    board: Arc<Board>,
    token: AccessToken,
    port: u16,
}

/// Serves the page until `stopped` says so; `ready` is told its address.
///
/// # Errors
/// The port is taken; the system gives no threads or watches.
pub fn serve(
    options: PreviewOptions,
    ready: impl FnOnce(&str),
    stopped: impl Fn() -> bool + Send + 'static,
) -> Result<(), Diagnostic> {
    let io = |what: &str, error: std::io::Error| Diagnostic::io(what, "start", &error);
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let runtime = runtime.map_err(|e| io("the server", e))?;
    let board = Board::new();
    let told = board.clone();
    let watch = FileWatch::start(move |changed| {
        told.order(Order::Changed(changed));
    })?;
    let port = options.port;
    let listener = runtime.block_on(tokio::net::TcpListener::bind(("127.0.0.1", port))).map_err(|e| {
        let problem = Diagnostic::error(format!("cannot listen on port {port}: {e}")).because(Cause::Io);
        problem.help("--port 0 takes any that is free")
    })?;
    let port = listener.local_addr().map_err(|e| io("the server", e))?.port();
    let token = AccessToken::new()?;
    let address = format!("http://127.0.0.1:{port}/?token={}", token.text());
    let worker = PreviewWorker::new(options, board.clone(), watch);
    let thread = std::thread::Builder::new().name("preview".into()).spawn(move || worker.run());
    let thread = thread.map_err(|e| io("the preview", e))?;
    let desk = Arc::new(Desk { board: board.clone(), token, port });
    ready(&address);
    runtime.block_on(async move {
        let router = Router::new().fallback(answer).with_state(desk);
        let ended = async move {
            while !stopped() {
                tokio::time::sleep(Duration::from_millis(50)).await;
            }
        };
        let serving = tokio::spawn(async move { axum::serve(listener, router).await });
        ended.await;
        // Pages that wait for news do not keep the command from ending.
        serving.abort();
    });
    board.order(Order::Stop);
    // Whatever it fell over is told by then.
    let _ = thread.join();
    Ok(())
}

async fn answer(State(desk): State<Arc<Desk>>, request: Request) -> Response {
    let (parts, body) = request.into_parts();
    let queried = query(&parts.uri, "token");
    let given = text(&parts.headers, "x-anim-token").map(str::to_string).or(queried);
    let credentials = Credentials {
        host: text(&parts.headers, "host"),
        origin: text(&parts.headers, "origin"),
        fetch_site: text(&parts.headers, "sec-fetch-site"),
        token: given.as_deref(),
    };
    match admit(credentials, desk.port, &desk.token) {
        Ok(()) => {}
        Err(Refusal::Token) => {
            return plain(
                StatusCode::FORBIDDEN,
                "open the whole address that `anim preview` has printed, token included\n",
            );
        }
        Err(Refusal::Host | Refusal::Origin) => {
            return plain(StatusCode::FORBIDDEN, "this is not the page's own address\n");
        }
    }
    let Ok(body) = to_bytes(body, limits::PREVIEW_MESSAGE_BYTES).await else {
        return plain(StatusCode::PAYLOAD_TOO_LARGE, "the message is too long\n");
    };
    // What is asked of a proxy has no path at all.
    let path = parts.uri.path().trim_start_matches('/').to_string();
    let (first, rest) = path.split_once('/').unwrap_or((&path, ""));
    match (&parts.method, first) {
        (&Method::GET, "") => respond("text/html; charset=utf-8", PAGE.as_bytes().to_vec()),
        (&Method::GET, "state") => state(&desk, query(&parts.uri, "since")).await,
        (&Method::GET, "picture" | "linear" | "file") => picture(&desk, first, rest.parse().unwrap_or(0)),
        (&Method::GET, "golden") => golden(&desk, rest.parse().unwrap_or(0)),
        (&Method::GET, "layers") => columns(&desk, Order::Layers).await,
        (&Method::GET, "noise") => columns(&desk, Order::Noise).await,
        (&Method::GET, "part") => {
            let index = query(&parts.uri, "index").and_then(|text| text.parse().ok()).unwrap_or(0);
            let kind = query(&parts.uri, "kind").unwrap_or_default();
            part(&desk, &json!({ "kind": kind, "index": index })).await
        }
        (&Method::POST, _) => post(&desk, first, &body).await,
        _ => plain(StatusCode::NOT_FOUND, "there is nothing here\n"),
    }
}

fn text<'a>(headers: &'a HeaderMap, name: &str) -> Option<&'a str> {
    headers.get(name)?.to_str().ok()
}

/// A value of the query; those that are asked for are words and numbers.
fn query(uri: &Uri, name: &str) -> Option<String> {
    let pairs = uri.query()?.split('&').filter_map(|pair| pair.split_once('='));
    pairs.into_iter().find(|(known, _)| *known == name).map(|(_, value)| value.to_string())
}

fn respond(kind: &'static str, body: Vec<u8>) -> Response {
    let mut response = Response::new(Body::from(body));
    let policy = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src 'self' blob: data:; \
                  connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
    let headers = [
        (header::CONTENT_TYPE, kind),
        (header::CACHE_CONTROL, "no-store"),
        (header::CONTENT_SECURITY_POLICY, policy),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    ];
    for (name, value) in headers {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

fn plain(status: StatusCode, text: &str) -> Response {
    let mut response = respond("text/plain; charset=utf-8", text.as_bytes().to_vec());
    *response.status_mut() = status;
    response
}

fn answer_json(value: &Value) -> Response {
    respond("application/json", value.to_string().into_bytes())
}

async fn state(desk: &Desk, since: Option<String>) -> Response {
    let since: u64 = since.and_then(|text| text.parse().ok()).unwrap_or(0);
    let mut versions = desk.board.versions();
    // Another version may be a lower one: that of a server that was started again.
    let wait = async { while *versions.borrow_and_update() == since && versions.changed().await.is_ok() {} };
    let _ = tokio::time::timeout(PATIENCE, wait).await;
    let (mut state, version) = desk.board.read(|shown| shown.state.clone());
    if !state.is_object() {
        state = json!({ "starting": true });
    }
    state["version"] = json!(version);
    answer_json(&state)
}

fn picture(desk: &Desk, form: &str, id: u64) -> Response {
    let gone = || plain(StatusCode::NOT_FOUND, "this picture has given way to newer ones\n");
    let Some(picture) = desk.board.read(|shown| shown.pictures.get(id).cloned()).0 else { return gone() };
    let mut bytes: Vec<u8> = picture.size.iter().flat_map(|side| side.to_le_bytes()).collect();
    match form {
        "picture" => {
            bytes.extend_from_slice(&picture.rgb);
            respond("application/octet-stream", bytes)
        }
        "linear" => {
            let Some(film) = picture.film else { return gone() };
            bytes.extend(film.pixels.iter().flatten().flat_map(|x| x.to_le_bytes()));
            respond("application/octet-stream", bytes)
        }
        _ => match picture.file.filter(|file| file.starts_with(b"\x89PNG")) {
            Some(file) => respond("image/png", file.to_vec()),
            None => {
                let none = Vec::new();
                let file = encode_small_png(picture.size, &PngPixels::Rgb(&picture.rgb), &none, &none);
                file.map_or_else(|_| gone(), |file| respond("image/png", file))
            }
        },
    }
}

/// The golden frame beside the project's `golden.ron`.
fn golden(desk: &Desk, frame: u32) -> Response {
    let none = || plain(StatusCode::NOT_FOUND, "there is no golden frame\n");
    let (found, _) = desk.board.read(|shown| shown.state["golden"].as_str().map(std::path::PathBuf::from));
    let Some(stem) = found else { return none() };
    let name = stem.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let names = [format!("{name}.{frame:04}.png"), format!("{name}.png")];
    let file = names.iter().map(|name| stem.with_file_name(name)).find(|file| file.is_file());
    match file.map(|file| files::read_bytes(&file, limits::FRAME_FILE_BYTES)) {
        Some(Ok(bytes)) => respond("image/png", bytes),
        _ => none(),
    }
}

async fn columns(desk: &Desk, order: impl FnOnce(PageReplyBytes) -> Order) -> Response {
    let (reply, answer) = oneshot::channel();
    if !desk.board.order(order(reply)) {
        return plain(StatusCode::SERVICE_UNAVAILABLE, "too much is waiting already\n");
    }
    match answer.await {
        Ok(Ok(bytes)) => respond("application/octet-stream", bytes),
        Ok(Err(problem)) => plain(StatusCode::CONFLICT, &problem),
        Err(_) => plain(StatusCode::CONFLICT, "the preview has stopped\n"),
    }
}

async fn part(desk: &Desk, subject: &Value) -> Response {
    match subject_of(subject) {
        Some(subject) => asked(desk, |reply| Order::Describe(subject, reply)).await,
        None => plain(StatusCode::BAD_REQUEST, "which part?\n"),
    }
}

/// Has an order answered by the worker.
async fn asked(desk: &Desk, order: impl FnOnce(super::board::PageReply) -> Order) -> Response {
    let (reply, answer) = oneshot::channel();
    if !desk.board.order(order(reply)) {
        return plain(StatusCode::SERVICE_UNAVAILABLE, "too much is waiting already\n");
    }
    match answer.await {
        Ok(Ok(json)) => answer_json(&json),
        Ok(Err(problem)) => plain(StatusCode::CONFLICT, &problem),
        Err(_) => plain(StatusCode::CONFLICT, "the preview could not do that\n"),
    }
}

async fn post(desk: &Desk, what: &str, body: &Bytes) -> Response {
    let message: Value = serde_json::from_slice(body).unwrap_or(Value::Null);
    let order = match what {
        "look" => message["frame"].as_u64().and_then(|frame| Some(Order::Look(frame.try_into().ok()?))),
        "define" => message["name"]
            .as_str()
            .map(|name| Order::Define(name.into(), message["value"].as_str().map(str::to_string))),
        "try" => message.as_array().and_then(|list| list.iter().map(trial_of).collect()).map(Order::Try),
        "render" => message["wanted"].as_bool().map(Order::Render),
        "undo" => return asked(desk, Order::Undo).await,
        "set" => {
            let one = |entry: &Value| {
                let (path, value) = (entry["path"].as_str()?.to_string(), entry["value"].as_str()?.to_string());
                Some(Assignment { path, value })
            };
            let list: Option<Vec<Assignment>> = message.as_array().and_then(|list| list.iter().map(one).collect());
            match list.filter(|list| !list.is_empty()) {
                Some(list) => return asked(desk, |reply| Order::Set(list, reply)).await,
                None => None,
            }
        }
        _ => return plain(StatusCode::NOT_FOUND, "there is nothing here\n"),
    };
    match order {
        None => plain(StatusCode::BAD_REQUEST, "this is not understood\n"),
        Some(order) => match desk.board.order(order) {
            true => answer_json(&json!({})),
            false => plain(StatusCode::SERVICE_UNAVAILABLE, "too much is waiting already\n"),
        },
    }
}

fn subject_of(value: &Value) -> Option<PagePart> {
    let index = value["index"].as_u64().and_then(|index| usize::try_from(index).ok());
    Some(match value["kind"].as_str()? {
        "camera" => PagePart::Camera,
        "render" => PagePart::Render,
        "entity" => PagePart::Entity(index?),
        "material" => PagePart::Material(index?),
        _ => return None,
    })
}

fn trial_of(value: &Value) -> Option<Trial> {
    Some(Trial {
        subject: subject_of(&value["subject"])?,
        component: value["component"].as_str().map(str::to_string),
        field: value["field"].as_str()?.to_string(),
        value: value["value"].clone(),
    })
}
