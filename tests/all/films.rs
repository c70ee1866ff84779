//! Films and sheets as a user makes them: every format, every way to fail, and what a film says of itself.

use std::path::Path;
use std::process::Command;

use crate::tool::{Run, Sandbox};

const SCENE: &str = r#"(
    render: (size: (24, 16), samples: 1),
    entities: [
        (name: "ball", sphere: (), material: "red"),
        (name: "lamp", point_light: (position: (2.0, 5.0, 3.0))),
    ],
    materials: { "red": (color: (0.8, 0.1, 0.1)) },
)"#;

const SCRIPT: &str = r#"animation(#{ scene: "a.ron", frames: 12, fps: "24000/1001", mode: "loop" });
fn frame(s, f) {
    s.get("ball").translation = orbit([0, 0, 0], 1.0, f.t) * param("wide", 1.0);
}"#;

fn desk() -> Sandbox {
    let desk = Sandbox::new();
    desk.write("a.ron", SCENE).write("a.rhai", SCRIPT);
    desk
}

/// Runs `anim` with words that may have blanks in them, and with another `PATH`.
fn run(desk: &Sandbox, words: &[&str], path: Option<&Path>) -> Run {
    let mut command = Command::new(env!("CARGO_BIN_EXE_anim"));
    command.args(words).current_dir(desk.path(""));
    if let Some(path) = path {
        command.env("PATH", path);
    }
    let output = command.output().unwrap();
    Run {
        code: output.status.code().unwrap_or(-1),
        stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
        stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

fn strays(desk: &Sandbox) -> Vec<String> {
    desk.files().into_iter().filter(|file| file.contains(".anim-tmp")).collect()
}

#[test]
fn a_script_becomes_a_film_of_any_format_with_the_same_bytes_on_every_way() {
    let desk = desk();
    for ending in ["gif", "apng", "webp", "y4m"] {
        let said = desk.anim(&format!("film a.rhai -o new/a.{ending} --threads 1")).ok().stdout;
        assert!(said.contains("12 frames of 24x16, 24000/1001 a second, 0.50 s"), "{said}");
        // From frames that are there now, from their folder, and by another command.
        desk.anim(&format!("film a.rhai -o again.{ending} --threads 2")).ok();
        desk.anim(&format!("film frames/a -o folder.{ending} --fps 24000/1001")).ok();
        desk.anim(&format!("film frames/a/a.####.png -o pattern.{ending} --fps 23.976")).ok();
        desk.anim(&format!("render a.rhai -o render.{ending} --force")).ok();
        let film = desk.read(&format!("new/a.{ending}"));
        for other in ["again", "folder", "pattern", "render"] {
            assert!(desk.read(&format!("{other}.{ending}")) == film, "{other}.{ending}");
        }
        let info = desk.anim(&format!("info new/a.{ending}")).ok().stdout;
        assert!(info.contains("Size: 24x16") && info.contains("12 frames, 0.5"), "{info}");
        for note in ["Software: anim", "Source: a.rhai", "Frames: 1-12", "Rate: 24000/1001", "Hash: "] {
            assert!(info.contains(note), "{ending}: {note}: {info}");
        }
    }
    assert_eq!(strays(&desk), [""; 0]);
    assert_eq!(desk.files().iter().filter(|file| file.starts_with("frames/a/a.")).count(), 12);
}

#[test]
fn what_a_film_is_made_of_is_in_its_hash() {
    let desk = desk();
    let hash = |words: &str| {
        desk.anim(&format!("film a.rhai -o a.webp {words}")).ok();
        let info = desk.anim("info a.webp").ok().stdout;
        info.lines().find(|line| line.starts_with("Hash: ")).unwrap().to_string()
    };
    let first = hash("");
    assert_eq!(hash("--force"), first);
    assert_ne!(hash("-D wide=2.0"), first);
    assert_ne!(hash("--frames 1-11"), first);
    assert_eq!(hash("--frames-in elsewhere"), first);
    assert!(desk.exists("elsewhere/a.0012.png"));
}

#[test]
fn fewer_frames_take_as_long_and_a_loop_has_no_halt() {
    let desk = desk();
    let said = desk.anim("film a.rhai -o a.gif --frames 1-12x4").ok().stdout;
    assert!(said.contains("3 frames of 24x16, 6000/1001 a second, 0.50 s"), "{said}");
    let said = desk.anim("film a.rhai -o a.gif --frames 1,2,5 --fps 10").ok().stdout;
    assert!(said.contains("3 frames of 24x16, 10 a second"), "{said}");
    // A clip ends where it began.
    desk.write("clip.rhai", SCRIPT.replace("\"loop\"", "\"clip\""));
    let run = desk.anim("film clip.rhai -o clip.apng").ok();
    assert!(run.stdout.contains("11 frames") && run.stderr.contains("--plays 1"), "{} {}", run.stdout, run.stderr);
    assert!(desk.anim("film clip.rhai -o clip.apng --plays 1").ok().stdout.contains("12 frames"));
    assert!(desk.anim("film clip.rhai -o clip.y4m").ok().stdout.contains("12 frames"));
    // Browsers show no more frames than that in a second.
    let run = desk.anim("film a.rhai -o fast.gif --fps 60").ok();
    assert!(run.stderr.contains("4 of 12 are left out"), "{}", run.stderr);
    assert!(desk.anim("film a.rhai -o fast.webp --fps 120").ok().stderr.contains("slow 120 frames a second down"));
}

#[test]
fn wrong_arguments_are_explained_before_anything_is_rendered() {
    let desk = desk();
    desk.anim("film a.rhai").fails(2, &["where shall the film go?", "-o show.mp4"]);
    desk.anim("film a.rhai -o a.avi").fails(2, &[".apng .gif .webp .y4m .mp4 .webm .mov", "a.avi"]);
    desk.anim("film a.ron -o a.gif").fails(2, &["a.ron is one picture"]);
    desk.anim("film a.rhai -o a.gif --shard 1/2").fails(2, &["--shard"]);
    desk.anim("film a.rhai -o a.gif --crf 20").fails(2, &["--crf does not concern a .gif film"]);
    desk.anim("film a.rhai -o a.webp --palette shared").fails(2, &["--palette does not concern"]);
    desk.anim("film a.rhai -o a.gif --fps 0").fails(2, &["24000/1001"]);
    desk.anim("film a.rhia -o a.gif").fails(3, &["a.rhia"]);
    desk.write("b.rhai", "animation(#{ scene: \"a.ron\", frames: 4, fps: \"24/0\" }); fn frame(s, f) {}");
    desk.anim("film b.rhai -o a.gif").fails(3, &["b.rhai:1:", "no frame rate", "24000/1001"]);
    desk.write(
        "c.rhai",
        "animation(#{ scene: \"a.ron\", frames: 4 }); fn frame(s, f) { s.render.size = [8 * f.number, 8]; }",
    );
    desk.anim("film c.rhai -o a.gif").fails(3, &["frame 1 has 8x8 pixels and frame 2 16x8", "--size"]);
    desk.write("a.gif/x", "");
    desk.anim("film a.rhai -o a.gif").fails(2, &["that is a folder"]);
    assert_eq!(desk.files(), ["a.gif/x", "a.rhai", "a.ron", "b.rhai", "c.rhai"]);
}

#[test]
fn frames_that_are_no_sequence_are_explained_and_leave_no_film() {
    let desk = desk();
    desk.anim("a.rhai -o f").ok();
    desk.anim("film f -o a.gif --spp 4").fails(2, &["finished frames"]);
    desk.anim("film nothing.####.png -o a.gif").fails(3, &["no numbered frames"]);
    std::fs::remove_file(desk.path("f/a.0004.png")).unwrap();
    desk.anim("film f -o a.gif").fails(3, &["f/a.####.png: frame 4 is missing", "--frames"]);
    desk.anim("film f -o some.gif --frames 5-12").ok();
    // Cut short, of another size, no picture at all.
    let whole = desk.read("f/a.0003.png");
    for ending in ["gif", "apng", "webp", "y4m"] {
        desk.write("f/a.0004.png", &whole[..whole.len() - 20]);
        desk.anim(&format!("film f -o a.{ending}")).fails(3, &["a.0004.png", "damaged"]);
        desk.write("f/a.0004.png", "no picture");
        desk.anim(&format!("film f -o a.{ending}")).fails(3, &["a.0004.png"]);
        desk.anim("render a.ron --size 8x8 -o f/a.0004.png --overwrite").ok();
        desk.anim(&format!("film f -o a.{ending}")).fails(3, &["a.0004.png has 8x8 pixels", "24x16"]);
    }
    desk.write("f/b.0001.png", &whole);
    desk.anim("film f -o a.gif").fails(3, &["several sequences", "a.####.png (12 frames), b.####.png (1 frame)"]);
    assert!(!desk.files().iter().any(|file| file.starts_with("a.") && file.len() > 6) && strays(&desk).is_empty());
}

#[test]
fn a_frame_that_cannot_be_rendered_leaves_no_film() {
    let desk = desk();
    desk.write(
        "bad.rhai",
        "animation(#{ scene: \"a.ron\", frames: 4 }); fn frame(s, f) { if f.number == 3 { s.get(\"x\"); } }",
    );
    desk.anim("film bad.rhai -o a.gif").fails(4, &["in frame 3", "a.gif is not written"]);
    assert!(!desk.exists("a.gif") && strays(&desk).is_empty());
    assert!(desk.exists("frames/bad/bad.0004.png"));
}

#[cfg(unix)]
mod on_unix {
    use std::os::unix::fs::PermissionsExt;

    use super::*;

    /// A folder with a program that is called ffmpeg, does this, and knows all encoders.
    fn ffmpeg(desk: &Sandbox, body: &str) -> std::path::PathBuf {
        let list = "case \"$*\" in *-encoders*) echo ' V libx264 x'; echo ' V libvpx-vp9 x'; exit 0;; esac\n";
        desk.write("bin/ffmpeg", format!("#!/bin/sh\nPATH=/bin:/usr/bin\n{list}{body}\n"));
        std::fs::set_permissions(desk.path("bin/ffmpeg"), PermissionsExt::from_mode(0o755)).unwrap();
        desk.path("bin")
    }

    #[test]
    fn without_ffmpeg_the_error_says_what_to_do() {
        let desk = desk();
        let nowhere = desk.path("nowhere");
        for ending in ["mp4", "webm", "mov"] {
            let run = run(&desk, &["film", "a.rhai", "-o", &format!("a.{ending}")], Some(&nowhere));
            run.fails(5, &["`ffmpeg`, which is not on the PATH", "apt install ffmpeg", ".apng, .gif, .webp or .y4m"]);
        }
        // Nothing was rendered for it.
        assert_eq!(desk.files(), ["a.rhai", "a.ron"]);
        let lacking = ffmpeg(&desk, "exit 1");
        let run = run(&desk, &["film", "a.rhai", "-o", "a.mp4", "--codec", "h265"], Some(&lacking));
        run.fails(5, &["bin/ffmpeg has no encoder `libx265`", "--codec"]);
    }

    #[test]
    fn an_encoder_that_dies_or_lies_leaves_no_film() {
        let desk = desk();
        let film = |body: &str, said: &[&str]| {
            let path = ffmpeg(&desk, body);
            run(&desk, &["film", "a.rhai", "-o", "a.mp4"], Some(&path)).fails(5, said);
            assert!(!desk.exists("a.mp4") && strays(&desk).is_empty());
        };
        film("head -c 100 > /dev/null; echo 'Conversion failed!' >&2; exit 1", &["Conversion failed!"]);
        film("cat > /dev/null; echo 'No space left on device' >&2; exit 1", &["No space left on device"]);
        film("kill -9 $$", &["ffmpeg ended early"]);
        // It says that all is well, and there is no film.
        film("cat > /dev/null; exit 0", &["0 of 12 frames and gives no reason"]);
        // What it says of its file is said of the film.
        let full = "cat > /dev/null; for film; do :; done; echo \"Error closing $film: disk full\" >&2; exit 0";
        film(full, &["0 of 12 frames: Error closing the film: disk full"]);
        // The frames are there for the next try.
        assert!(desk.exists("frames/a/a.0001.png"));
    }

    #[test]
    fn a_full_disk_leaves_no_film() {
        let desk = desk();
        desk.anim("a.rhai -o f --size 120x80").ok();
        for ending in ["gif", "apng", "webp", "y4m"] {
            // Files may have so many blocks of 512 bytes, and going on past that is an error and no signal.
            let line = format!("trap '' XFSZ; ulimit -f 4; exec {} film f -o a.{ending}", env!("CARGO_BIN_EXE_anim"));
            let output = Command::new("sh").args(["-c", &line]).current_dir(desk.path("")).output().unwrap();
            let said = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(5), "{ending}: {said}");
            assert!(said.contains(&format!("cannot write a.{ending}")), "{said}");
            assert!(!desk.exists(&format!("a.{ending}")) && strays(&desk).is_empty());
        }
    }

    /// Whether there is an ffmpeg to try films with; says so if there is none.
    fn has_ffmpeg(test: &str) -> bool {
        let found = Command::new("ffmpeg").arg("-version").output().is_ok_and(|output| output.status.success());
        if !found {
            println!("{test}: skipped, there is no ffmpeg on the PATH");
        }
        found
    }

    /// Grey, primaries, and red next to blue, in squares of eight pixels.
    const CARD: [[u8; 3]; 8] = [
        [128, 128, 128],
        [255, 255, 255],
        [0, 0, 0],
        [255, 0, 0],
        [0, 255, 0],
        [0, 0, 255],
        [200, 50, 20],
        [64, 64, 64],
    ];

    fn card(desk: &Sandbox) {
        for frame in 1..=5u32 {
            let color = |x: u32, y: u32| image::Rgb(CARD[((x / 8 + frame * (y / 8)) % 8) as usize]);
            let picture = image::RgbImage::from_fn(63, 31, color);
            std::fs::create_dir_all(desk.path("card")).unwrap();
            picture.save(desk.path(&format!("card/c.{frame:04}.png"))).unwrap();
        }
    }

    #[test]
    fn ffmpeg_gives_back_number_time_and_colours() {
        if !has_ffmpeg("ffmpeg_gives_back_number_time_and_colours") {
            return;
        }
        let desk = desk();
        card(&desk);
        for film in [
            "a.mp4",
            "a.webm",
            "a.mov",
            "p.mov --codec prores",
            "f.mp4 --pixel-format yuv444p",
            "a.y4m",
            "a.gif",
            "a.apng",
        ] {
            let said = desk.anim(&format!("film card --fps 24000/1001 -o {film}")).ok();
            let name = film.split(' ').next().unwrap();
            let odd = !["f.mp4", "a.y4m", "a.gif", "a.apng"].contains(&name);
            assert_eq!(said.stderr.contains("even sides"), odd, "{}", said.stderr);
            let info = desk.anim(&format!("info {name}")).ok().stdout;
            assert!(info.contains("5 frames, 0.2"), "{info}");
            assert!(info.contains("Rate: 24000/1001") && info.contains("Hash: "), "{name}: {info}");
            let raw = Command::new("ffmpeg")
                .args(["-v", "error", "-i", name, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"])
                .current_dir(desk.path(""))
                .output()
                .unwrap()
                .stdout;
            let width = if odd { 64 } else { 63 };
            let height = if odd && name != "p.mov" { 32 } else { 31 };
            let length = 3 * width * height;
            assert_eq!(raw.len(), 5 * length, "{name}");
            for (index, pixels) in raw.chunks(length).enumerate() {
                for (x, y) in (0..7).flat_map(|x| (0..3).map(move |y| (8 * x + 4, 8 * y + 4))) {
                    let wanted = CARD[(x / 8 + (index + 1) * (y / 8)) % 8];
                    let found = &pixels[3 * (y * width + x)..][..3];
                    let apart = (0..3).map(|i| wanted[i].abs_diff(found[i])).max().unwrap();
                    // Small fields beside others: a lossy codec moves greys as it moves colours there.
                    let is_grey = wanted[0] == wanted[1] && wanted[1] == wanted[2];
                    // YUV4MPEG2 has no word for the matrix of its planes, which are BT.709: ffmpeg takes them for BT.601.
                    if name == "a.y4m" && !is_grey {
                        continue;
                    }
                    let is_exact = ["a.y4m", "a.gif", "a.apng"].contains(&name);
                    let most = if is_exact && is_grey { 1 } else { 16 };
                    assert!(apart <= most, "{name} {index} {x} {y}: {wanted:?} {found:?}");
                }
            }
        }
    }
}

#[test]
fn sheets_show_frames_that_are_spread_evenly() {
    let desk = desk();
    let said = desk.anim("sheet a.rhai -o s.png --count 4 --columns 2").ok().stdout;
    assert!(said.contains("s.png: 4 pictures"), "{said}");
    let info = desk.anim("info s.png").ok().stdout;
    assert!(info.contains("Source: a.rhai") && info.contains("Sheet: 1 | 5 | 8 | 12"), "{info}");
    assert_eq!(desk.files().iter().filter(|file| file.starts_with("frames/a/a.")).count(), 4);
    // The same of finished frames, with what a label can say.
    desk.anim("a.rhai").ok();
    desk.anim("sheet frames/a -o t.png --count 4 --columns 2").ok();
    let picture = |name: &str| image::open(desk.path(name)).unwrap().to_rgb8();
    assert_eq!(picture("s.png"), picture("t.png"));
    let words = ["sheet", "a.rhai", "--frames", "1,7", "--label", "#{frame:04} {seconds:.3} {name}"];
    run(&desk, &words, None).ok();
    let info = desk.anim("info frames/a.sheet.png").ok().stdout;
    assert!(info.contains("Sheet: #0001 0.000 a | #0007 0.250 a"), "{info}");
    let bare = ["sheet", "a.rhai", "--frames", "1,7", "--label", "", "-o", "bare.png"];
    assert!(run(&desk, &bare, None).ok().stdout.contains("bare.png: 2 pictures"));
    assert!(picture("bare.png").height() < picture("frames/a.sheet.png").height());
}

#[test]
fn sheets_sweep_parameters_and_keep_what_was_rendered() {
    let desk = desk();
    let said = desk.anim("sheet a.rhai -o s.png --sweep wide=0..2/3 --frames 4").ok().stdout;
    assert!(said.contains("3 pictures"), "{said}");
    let file = "frames/a.sweep/wide=1.0004.png";
    assert!(desk.exists(file), "{:?}", desk.files());
    assert!(desk.anim("info s.png").ok().stdout.contains("Sheet: wide 0 | wide 1 | wide 2"));
    // The picture in the middle is the frame.
    desk.anim("a.rhai -o f --frames 4").ok();
    assert_eq!(desk.read(file), desk.read("f/a.0004.png"));
    let before = std::fs::metadata(desk.path(file)).unwrap().modified().unwrap();
    desk.anim("sheet a.rhai -o s.png --sweep wide=0..2/3 --frames 4").ok();
    assert_eq!(std::fs::metadata(desk.path(file)).unwrap().modified().unwrap(), before);
    desk.write(
        "two.rhai",
        SCRIPT.replace("param(\"wide\", 1.0)", "param(\"wide\", 1.0) + [0, param(\"high\", 0.0), 0]"),
    );
    let said = desk.anim("sheet two.rhai -o g.png --sweep wide=1,2,3 --sweep high=0..1/2").ok().stdout;
    assert!(said.contains("6 pictures"), "{said}");
    let info = desk.anim("info g.png").ok().stdout;
    assert!(info.contains("wide 1   high 0 | wide 2   high 0 | wide 3   high 0 | wide 1   high 1"), "{info}");
    let size = image::image_dimensions(desk.path("g.png")).unwrap();
    assert!(size.0 > size.1, "{size:?}");
}

#[test]
fn sheets_of_several_scenes_and_what_is_wrong_with_sheets() {
    let desk = desk();
    desk.write("b.ron", SCENE.replace("0.8, 0.1, 0.1", "0.1, 0.1, 0.8").replace("(24, 16)", "(16, 16)"));
    assert!(desk.anim("sheet a.ron b.ron a.rhai").ok().stdout.contains("frames/a.sheet.png: 3 pictures"));
    assert!(desk.anim("info frames/a.sheet.png").ok().stdout.contains("Sheet: a | b | a"));
    desk.anim("sheet a.rhai -o s.jpg").fails(2, &["a sheet is a .png file"]);
    desk.anim("sheet a.rhai -o s.png --label {fraem}").fails(2, &["there is no `fraem`", "did you mean `frame`?"]);
    desk.anim("sheet a.rhai -o s.png --label {frame").fails(2, &["stands alone"]);
    desk.anim("sheet a.rhai -o s.png --sweep wdie=1,2").fails(2, &["did you mean `wide`?"]);
    desk.anim("sheet a.rhai -o s.png --sweep wide=1..2").fails(2, &["aperture=0..0.4/9"]);
    desk.anim("sheet a.rhai -o s.png --sweep wide=1,2 -D wide=3").fails(2, &["has a value already"]);
    desk.anim("sheet a.rhai -o s.png --sweep wide=1,2 --sweep wide=1,2").fails(2, &["has a value already"]);
    desk.anim("sheet a.rhai a.ron -o s.png --sweep wide=1,2").fails(2, &["only one script"]);
    desk.anim("sheet a.rhai -o s.png --sweep wide=1,2 --frames 1-3").fails(2, &["one frame of each"]);
    desk.anim("sheet frames -o s.png").fails(3, &["no numbered frames"]);
    desk.anim("sheet a.rhai -o s.png --columns 0").fails(2, &["--columns"]);
    assert!(!desk.exists("s.png") && strays(&desk).is_empty());
}
