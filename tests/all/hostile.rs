//! Scripts that mean no good, one of each kind: all of them end with 3 and a place.

use crate::tool::Sandbox;

/// What it does beside its frame function, the body of that from line 4 on, and what is said, with the place.
type Case = (&'static str, String, &'static [&'static str]);

fn cases() -> Vec<Case> {
    let many = |text: &str, count: usize| text.repeat(count);
    let line = |text: &str| text.to_string();
    vec![
        // Recursion: of functions, of a closure that holds itself, of a function that stands for another one.
        ("fn g(n) { h(n) } fn h(n) { g(n) }", line("g(1);"), &["a.rhai:4:1:", "call each other too deep"]),
        ("", line("let m = #{};\n m.f = |x| m.f(x);\n m.f(1);"), &["a.rhai:6:", "while a closure holds it"]),
        ("fn print(x) { print(x) }", line("print(1);"), &["a.rhai:4:1:", "too deep"]),
        (
            "",
            line("let c = |x| x;\n for i in 0..3000 {\n let d = c;\n c = |x| d.call(x);\n }\n c.call(1);"),
            &["a.rhai:9:4:", "too deep"],
        ),
        // Texts, lists and maps that grow.
        ("", line("let t = \"x\";\n loop { t += t; }"), &["a.rhai:5:11:", "more than 512 MiB"]),
        ("", line("let t = \"ab\";\n t.pad(1000000000000, \"xy\");"), &["a.rhai:5:4:", "more than 512 MiB"]),
        ("", line("let a = [1];\n loop { a += a; }"), &["a.rhai:5:9:", "more than 512 MiB"]),
        ("", line("let a = [];\n a.pad(1000000000, 1);"), &["a.rhai:5:4:", "more than 512 MiB"]),
        ("", line("let a = [];\n try { a.pad(1000000000, 1); } catch { }"), &["a.rhai:5:10:", "more than 512 MiB"]),
        // Texts that nest deep or are wide.
        ("", format!("let b = {}1{};", many("(", 4000), many(")", 4000)), &["a.rhai:4:", "nest too deep"]),
        ("", format!("let b = {}1{};", many("[", 4000), many("]", 4000)), &["a.rhai:4:", "nest too deep"]),
        ("", format!("let b = 1{};", many("+1", 4000)), &["a.rhai:4:", "nest too deep"]),
        ("", format!("let v = 1;\n v{};", many(".x", 4000)), &["a.rhai:5:", "nest too deep"]),
        (
            "fn h(a) {}",
            format!("h(1{});", many(", 1", 20_000)),
            &["a.rhai:4:1:", "called with 20001 arguments, more than 64", "a list"],
        ),
        // Messages that would fill a screen, or a disk.
        ("", line("let t = \"x\";\n for i in 0..16 { t += t; }\n throw t;"), &["a.rhai:6:", "xxx... (65536 letters)"]),
        // What is made of the scene.
        ("", line("let p = s.spawn(#{ name: \"p\" });\n p.parent = \"p\";"), &["a.rhai:5:4:", "in a circle"]),
        ("", line("let e = s.spawn(#{});\n s.despawn(e);\n e.yaw = 1;"), &["a.rhai:6:4:", "was removed"]),
        ("", line("s.spawn(#{ sphere: #{ radius: 0.0 / 0.0 } });"), &["a.rhai:4:23:", "a finite number, not NaN"]),
        ("", line("s.render.size = [9223372036854775807, 1];"), &["a.rhai:4:", "`size`"]),
        ("", line("s.spawn(#{ mesh: #{ file: \"/dev/zero\" } });"), &["a.rhai:4:3:", "outside of the project"]),
        ("", line("s.camera.fov = |x| x;"), &["a.rhai:4:", "cannot hold this"]),
        ("", line("throw #{ a: [1, #{}] };"), &["a.rhai:4:1:", "in frame 1"]),
    ]
}

#[test]
fn hostile_scripts_end_with_a_place() {
    let desk = Sandbox::new();
    for (top, body, said) in cases() {
        desk.write("a.rhai", format!("animation(#{{ frames: 2 }});\n{top}\nfn frame(s, f) {{\n{body}\n}}\n"));
        desk.anim("check a.rhai").fails(3, said);
    }
    assert_eq!(desk.files(), ["a.rhai"]);
}

/// Steps that are slow, each within its time: the script ends at one of them and is not run again to find out where.
#[test]
fn slow_steps_end_at_their_line() {
    let desk = Sandbox::new();
    let limits = "limits: #{ seconds: 1, operations: 2000000 }";
    let slow = "loop {\n t.make_upper(); t.make_lower();\n }";
    desk.write(
        "a.rhai",
        format!(
            "animation(#{{ {limits} }});\nfn frame(s, f) {{\nlet t = \"ab\"; for i in 0..22 {{ t += t; }}\n{slow}\n}}\n"
        ),
    );
    desk.anim("check a.rhai").fails(3, &["a.rhai:5:", "runs for too long: more than 1 s in one call"]);
}

#[test]
fn too_many_functions_are_told_at_once() {
    let desk = Sandbox::new();
    let functions: String = (0..5_000).map(|i| format!("fn g{i}() {{ {i} }}\n")).collect();
    desk.write("a.rhai", format!("animation(#{{}});\n{functions}fn frame(s, f) {{ }}\n"));
    // Looking for further mistakes takes time in proportion to the text, and not the six seconds that end a script.
    desk.anim("check a.rhai").fails(3, &["a.rhai:", "more than 4096 functions"]);
}

/// A script whose steps take long, each within its limits, in a program that is killed.
#[cfg(target_os = "linux")]
#[test]
fn the_process_of_a_script_ends_with_the_program() {
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};

    let parent_of = |pid: &str| {
        let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).ok()?;
        stat.rsplit(") ").next()?.split(' ').nth(1).map(str::to_string)
    };
    let children = |of: u32| -> Vec<String> {
        let all = std::fs::read_dir("/proc").unwrap().flatten();
        let all = all.map(|entry| entry.file_name().to_string_lossy().into_owned());
        all.filter(|pid| parent_of(pid).is_some_and(|parent| parent == of.to_string())).collect()
    };
    let until = |what: &dyn Fn() -> bool| {
        let start = Instant::now();
        while !what() && start.elapsed() < Duration::from_secs(30) {
            std::thread::sleep(Duration::from_millis(20));
        }
        what()
    };
    let desk = Sandbox::new();
    let body = "fn start(s) { 0 }\nfn step(state, f) { let x = 0; while x < 20000 { x += 1; } state + 1 }";
    desk.write("a.rhai", format!("animation(#{{ frames: 90000 }});\n{body}\nfn frame(s, f) {{ f.state; }}\n"));
    let mut program = Command::new(env!("CARGO_BIN_EXE_anim"))
        .args(["check", "a.rhai"])
        .current_dir(desk.path(""))
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    assert!(until(&|| !children(program.id()).is_empty()));
    let hosts = children(program.id());
    // Long enough to be in the middle of its steps.
    std::thread::sleep(Duration::from_millis(300));
    program.kill().unwrap();
    program.wait().unwrap();
    // An ended process may stay in the list until its new parent has asked for it.
    let is_gone = |pid: &String| {
        let stat = std::fs::read_to_string(format!("/proc/{pid}/stat"));
        stat.is_ok_and(|stat| stat.contains(") Z")) || !std::path::Path::new(&format!("/proc/{pid}")).exists()
    };
    assert!(until(&|| hosts.iter().all(is_gone)), "{hosts:?}");
}
