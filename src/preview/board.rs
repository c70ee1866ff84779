//! What the worker shows and what the page asks for: the one place where both meet.
//!
//! The worker writes, the server reads; whoever waits for news waits for another version.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde_json::Value;
use tokio::sync::{oneshot, watch};

use super::pictures::PictureStore;
use crate::base::limits;
use crate::load::ron::edit::Assignment;

/// Where an answer of the worker goes: JSON, or what was wrong, for people.
pub type PageReply = oneshot::Sender<Result<Value, String>>;
/// As [`PageReply`], of bytes.
pub type PageReplyBytes = oneshot::Sender<Result<Vec<u8>, String>>;

/// Something that the worker is asked for.
pub enum Order {
    /// These files hold something else than before.
    Changed(Vec<PathBuf>),
    /// Somebody looks at this frame.
    Look(u32),
    /// A parameter of the script gets a value, or its default back.
    Define(String, Option<String>),
    /// Values that are tried out and not written: none ends that.
    Try(Vec<Trial>),
    /// Values that are written to the scene's file.
    Set(Vec<Assignment>, PageReply),
    /// The last edit that was written is taken back.
    Undo(PageReply),
    /// All frames that are not there are to be written, or no longer.
    Render(bool),
    /// What is known of a part of the scene.
    Describe(PagePart, PageReply),
    /// What the pixels of the picture show.
    Layers(PageReplyBytes),
    /// How many samples the pixels of the picture have, and how noisy they are.
    Noise(PageReplyBytes),
    /// The command ends.
    Stop,
}

/// A part of the scene, as the page names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PagePart {
    /// Its camera.
    Camera,
    /// Its settings.
    Render,
    /// An entity, by its number in authored order.
    Entity(usize),
    /// A material, by its number in authored order.
    Material(usize),
}

/// One value that is tried out.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// Where in the scene.
    pub subject: PagePart,
    /// Of an entity.
    pub component: Option<String>,
    /// As a scene names it.
    pub field: String,
    /// What it is to be, as JSON.
    pub value: Value,
}

/// What there is to be seen.
#[derive(Default)]
pub struct BoardContent {
    /// What the page is told, as it is told.
    pub state: Value,
    /// Pictures that the page may ask for.
    pub pictures: PictureStore,
}

/// Where the page and what renders meet: what there is to be seen, and what is asked for.
pub struct Board {
    shown: Mutex<BoardContent>,
    orders: Mutex<VecDeque<Order>>,
    ordered: Condvar,
    /// Raised by every order: what is traced is given up, and taken up again where nothing has changed.
    pub cancel: AtomicBool,
    /// Raised while a quick picture is made: questions wait until it is shown.
    pub is_sketching: AtomicBool,
    version: watch::Sender<u64>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Board {
    /// A board with nothing on it.
    pub fn new() -> Arc<Board> {
        Arc::new(Board {
            shown: Mutex::default(),
            orders: Mutex::default(),
            ordered: Condvar::new(),
            cancel: AtomicBool::new(false),
            is_sketching: AtomicBool::new(false),
            version: watch::channel(1).0,
        })
    }

    /// Asks the worker for something; false if it is behind with too much already.
    pub fn order(&self, order: Order) -> bool {
        let mut orders = lock(&self.orders);
        // Of what follows each other fast only the last counts, and a closed tab asks for nothing more.
        match &order {
            Order::Look(_) => orders.retain(|known| !matches!(known, Order::Look(_))),
            Order::Try(_) => orders.retain(|known| !matches!(known, Order::Try(_))),
            Order::Define(name, _) => orders.retain(|known| !matches!(known, Order::Define(other, _) if other == name)),
            Order::Changed(_)
            | Order::Set(..)
            | Order::Undo(_)
            | Order::Render(_)
            | Order::Describe(..)
            | Order::Layers(_)
            | Order::Noise(_)
            | Order::Stop => {}
        }
        if orders.len() >= limits::PREVIEW_ORDERS && !matches!(order, Order::Changed(_) | Order::Stop) {
            return false;
        }
        let can_wait = matches!(order, Order::Describe(..) | Order::Layers(_) | Order::Noise(_) | Order::Render(_));
        orders.push_back(order);
        if !(can_wait && self.is_sketching.load(Ordering::Relaxed)) {
            self.cancel.store(true, Ordering::Relaxed);
        }
        self.ordered.notify_all();
        true
    }

    /// Does something during which questions wait.
    pub fn sketching<T>(&self, work: impl FnOnce() -> T) -> T {
        self.is_sketching.store(true, Ordering::Relaxed);
        let done = work();
        self.is_sketching.store(false, Ordering::Relaxed);
        done
    }

    /// Puts an order behind the others that was given up for them.
    pub fn put_back(&self, order: Order) {
        lock(&self.orders).push_back(order);
    }

    /// The next order; waits for one if `wait`.
    pub fn next_order(&self, wait: bool) -> Option<Order> {
        let mut orders = lock(&self.orders);
        while orders.is_empty() && wait {
            orders =
                self.ordered.wait_timeout(orders, Duration::from_secs(1)).unwrap_or_else(PoisonError::into_inner).0;
        }
        let order = orders.pop_front();
        if orders.is_empty() {
            self.cancel.store(false, Ordering::Relaxed);
        }
        order
    }

    /// Changes what is shown, and tells those who wait.
    pub fn show(&self, change: impl FnOnce(&mut BoardContent)) {
        change(&mut lock(&self.shown));
        self.version.send_modify(|version| *version += 1);
    }

    /// What is shown, and its version.
    pub fn read<T>(&self, read: impl FnOnce(&BoardContent) -> T) -> (T, u64) {
        // The version first: news that come meanwhile are told again, and none is missed.
        let version = *self.version.borrow();
        (read(&lock(&self.shown)), version)
    }

    /// Waits for another version than the one that is known.
    pub fn versions(&self) -> watch::Receiver<u64> {
        self.version.subscribe()
    }
}
