//! Shapes that scripts model, as a user meets them.

use crate::tool::Sandbox;

#[test]
fn a_logo_from_text_is_the_same_whole_and_in_shards() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "logo.rhai",
        "animation(#{ frames: 4 });
         const WORDS = text(\"A\\u00f1im\", #{ size: 1.2, depth: 0.3, align: \"center\" });
         fn setup(s) {
             s.add_material(\"gold\", #{ color: [0.9, 0.7, 0.3], specular: 0.4 });
             s.spawn(#{ name: \"logo\", mesh: WORDS, material: \"gold\", translation: [0, -0.4, 0] });
             s.spawn(#{ mesh: torus(1.8, 0.05), pitch: 90, material: \"gold\" });
             s.spawn(#{ point_light: #{ position: [3, 4, 6] } });
             s.render.size = [48, 32]; s.render.samples = 1;
         }
         fn frame(s, f) { s.get(\"logo\").yaw = 60 * f.t; s.get(\"logo\").mesh = if f.number == 4 { text(\"end\") } else { WORDS }; }",
    );
    sandbox.anim("logo.rhai -o whole/").ok();
    sandbox.anim("logo.rhai -o parts/ --shard 1/2").ok();
    sandbox.anim("logo.rhai -o parts/ --shard 2/2").ok();
    let read = |folder: &str, frame: u32| sandbox.read(&format!("{folder}/logo.{frame:04}.png"));
    let all: Vec<Vec<u8>> = (1..=4).map(|frame| read("whole", frame)).collect();
    assert!(all.windows(2).all(|pair| pair[0] != pair[1]));
    assert!((1..=4).all(|frame| read("parts", frame) == all[frame as usize - 1]));
    // What is dumped shows the same.
    sandbox.anim("dump logo.rhai --frame 2 -o two.ron").ok();
    sandbox.anim("two.ron -o two.png").ok();
    let pixels = |bytes: &[u8]| image::load_from_memory(bytes).unwrap().to_rgb8().into_raw();
    assert_eq!(pixels(&sandbox.read("two.png")), pixels(&all[1]));
}

#[test]
fn thousands_of_instances_are_planned_at_once() {
    let sandbox = Sandbox::new();
    sandbox.write(
        "many.rhai",
        "animation(#{ frames: 3 });
         fn setup(s) {
             let places = [];
             for i in 0..10_000 { places.push([i % 316, 0, div(i, 316)]); }
             let all = s.instances(#{ name: \"post\", mesh: rounded_box(0.5, 0.1), material: () }, places, #{ scales: 0.5 });
             if all.len() != 10_000 { throw \"not all are there\"; }
         }
         fn frame(s, f) { s.get(\"post 9999\").translation.y = f.t; }",
    );
    let plan = sandbox.anim("plan many.rhai").ok().stdout;
    assert!(plan.contains("3 missing"), "{plan}");
}

#[test]
fn mistakes_in_shapes_are_answered_where_they_are_made() {
    let sandbox = Sandbox::new();
    let said = |body: &str, expected: &str| {
        sandbox.write("a.rhai", format!("animation(#{{ }});\nfn frame(s, f) {{ {body} }}"));
        sandbox.anim("check a.rhai").fails(3, &["a.rhai:2:", expected]);
    };
    said("lathe([[0, 0], [-1, 1]]);", "distance from the axis, not -1");
    said("lathe([[0, 0], [1, 1]], #{ segmnets: 3 });", "did you mean `segments`?");
    said("torus(1, 2);", "`tube_radius` 2 is larger than `radius` 1");
    said("extrude([[0, 0], [1, 0]], 1);", "an outline has three points at least, not 2");
    said("extrude([[0, 0], [1, 0], [0, 1]], -1);", "`depth` must be a length from 0, not -1");
    said("rounded_box(1, 0.6);", "at most half of the smallest side, 0.5, not 0.6");
    said("text(\" \");", "there is nothing to write");
    said("text(\"a\", #{ align: \"centre\" });", "did you mean `center`?");
    said("tube(3, 1);", "expected a path or a list of points");
    said("tube([[0, 0, 0], [1, 0, 0]], 0);", "`radius` must be a length above 0, not 0");
    said("s.instances(#{ sphere: #{} }, [[0, 0, 0]], #{ scales: [1, 2] });", "`scales` has 2 values for 1 places");
    said("s.spawn(#{ sphere: torus(2, 1) });", "expected a map of fields");
}
