//! Rules for make and for ninja: one for each task.

use std::fmt::Write;

use super::job::{FarmJob, Task};
use super::quote::{make_recipe, ninja, ninja_path, shell, shell_words};

/// The words that render one task.
fn words(job: &FarmJob, task: &Task) -> Vec<String> {
    let mut words = vec!["render".to_string()];
    words.extend(job.plan_words());
    let count = job.tasks.tasks.len();
    words.extend(["--shard".into(), format!("{}/{count}", task.number), "-o".into(), job.out.clone()]);
    words
}

fn head(job: &FarmJob) -> String {
    let count = job.tasks.tasks.len();
    let mut text = format!(
        "# {}: its frames in {count} tasks of about the same cost. Written by anim {}.\n#\n",
        job.name.replace(['\n', '\r'], " "),
        env!("CARGO_PKG_VERSION"),
    );
    if let Some(line) = job.price_line() {
        let _ = writeln!(text, "# {line}.\n#");
    }
    text
}

/// A makefile for GNU make.
///
/// Tasks are phony: whether a frame is what it should be is known by its hash, which time stamps do not tell. A task
/// with nothing to do takes as long as the evaluation of the script.
pub fn makefile(job: &FarmJob) -> String {
    let mut text = head(job);
    text += "#   make -j4                    four tasks at once, each on THREADS threads\n\
             #   make -j2 THREADS=8 ANIM='ssh node anim'\n\
             #   make check                  says what is missing\n#\n\
             # Frames that are there are kept, whatever their time stamps say: anim knows them by their hashes.\n\n";
    let _ = writeln!(text, "ANIM ?= {}\nTHREADS ?= 1\n", make_recipe(&shell(&job.anim)));
    let tasks: Vec<&Task> = job.tasks.tasks.iter().filter(|task| !task.frames.is_empty()).collect();
    let names: Vec<String> = tasks.iter().map(|task| format!("task-{}", task.number)).collect();
    let _ = writeln!(text, ".PHONY: all check {names}\n\nall: {names}", names = names.join(" "));
    if let Some(film) = &job.film {
        let film = make_recipe(&shell_words(&film_words(job, film)));
        let _ = writeln!(text, "\t$(ANIM) {film}");
    }
    for (task, name) in tasks.iter().zip(&names) {
        let command = make_recipe(&shell_words(&words(job, task)));
        let _ = writeln!(text, "\n{name}: # frames {}", task.list());
        let _ = writeln!(text, "\t$(ANIM) {command} --threads $(THREADS)");
    }
    let check = make_recipe(&shell_words(&check_words(job)));
    let _ = writeln!(text, "\ncheck:\n\t$(ANIM) {check}");
    text
}

fn film_words(job: &FarmJob, film: &str) -> Vec<String> {
    let mut words = vec!["film".to_string()];
    words.extend(job.plan_words());
    words.extend(["--frames-in".into(), job.out.clone(), "-o".into(), film.to_string()]);
    words
}

fn check_words(job: &FarmJob) -> Vec<String> {
    let mut words = vec!["plan".to_string()];
    words.extend(job.plan_words());
    words.extend(["-o".into(), job.out.clone(), "--exit-code".into()]);
    words
}

/// A file for ninja.
///
/// Frames are outputs and the files of the shot inputs, so that ninja starts what an edit may concern; anim then keeps
/// what it does not, and ninja sees that (`restat`).
pub fn ninja_file(job: &FarmJob) -> String {
    let mut text = head(job);
    text += "#   ninja -f THIS -j4           four tasks at once, each on one thread\n\
             #   ninja -f THIS check         says what is missing\n\n\
             ninja_required_version = 1.5\nthreads = 1\n";
    let _ = writeln!(text, "anim = {}\n", ninja(&shell(&job.anim)));
    text += "rule render\n  command = $anim $words --threads $threads\n  description = frames $frames\n  restat = 1\n\n\
             rule anim\n  command = $anim $words\n\n";
    let sources: Vec<String> = job.sources.iter().map(|path| ninja_path(path)).collect();
    let mut outputs = Vec::new();
    for (task, files) in job.tasks.tasks.iter().zip(&job.files).filter(|(task, _)| !task.frames.is_empty()) {
        let files: Vec<String> = files.iter().map(|path| ninja_path(path)).collect();
        let _ = writeln!(text, "build {}: render | {}", files.join(" "), sources.join(" "));
        let _ = writeln!(text, "  words = {}", ninja(&shell_words(&words(job, task))));
        let _ = writeln!(text, "  frames = {}\n", task.list());
        outputs.extend(files);
    }
    let _ = writeln!(text, "build frames: phony {}\n", outputs.join(" "));
    let _ = writeln!(text, "build check: anim\n  words = {}\n", ninja(&shell_words(&check_words(job))));
    match &job.film {
        Some(film) => {
            let _ = writeln!(text, "build {}: anim frames", ninja_path(film));
            let _ = writeln!(text, "  words = {}\n", ninja(&shell_words(&film_words(job, film))));
            let _ = writeln!(text, "default {}", ninja_path(film));
        }
        None => text += "default frames\n",
    }
    text
}
