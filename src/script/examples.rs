//! Examples of the reference as scripts that run: what stands behind `//` is checked.

use std::sync::Arc;

use glam::DVec3;

use crate::components::*;

/// A clip in which a node called `Head` goes through these rotations, a second from one to the next.
fn clip(name: &str, rotations: [[f32; 4]; 3]) -> Clip {
    let track = Track {
        node: "Head".into(),
        property: TrackProperty::Rotation,
        interpolation: KeyInterpolation::Linear,
        times: vec![0.0, 1.0, 2.0],
        values: rotations.concat(),
        width: 4,
    };
    Clip { name: name.into(), tracks: vec![track] }
}

/// The scene that examples are run in: a ball and a box with the tag `toy`, a lamp called `key`, a camera `close`, a material `brass`, and an
/// asset `robot` with a node `Head` and the clips `Nod` and `Turn`.
pub fn demo_scene() -> Arc<Scene> {
    let toy = |name: &str, shape: Component, x: f64| {
        let place = Transform { translation: DVec3::new(x, 0.5, 0.0), ..Transform::default() };
        let mut desc = EntityDesc::new([place.into(), shape, MaterialName("brass".into()).into()]).named(name);
        desc.tags = vec!["toy".into()];
        desc
    };
    let above = Transform { translation: DVec3::new(0.0, 4.0, 1.0), ..Transform::default() };
    let still = [0.0, 0.0, 0.0, 1.0];
    let clips =
        vec![clip("Nod", [still, [0.6, 0.0, 0.0, 0.8], still]), clip("Turn", [still, [0.0, 0.6, 0.0, 0.8], still])];
    let data = Arc::new(AssetData { clips, ..AssetData::default() });
    let robot = Asset { file: "robot.glb".into(), data, ..Asset::default() };
    let on_robot = Transform { parent: Some("robot".into()), ..Transform::default() };
    Arc::new(Scene {
        cameras: vec![("close".into(), Camera { from: DVec3::new(0.0, 1.0, 3.0), fov: 25.0, ..Camera::default() })],
        materials: vec![("brass".into(), Material::default())],
        entities: vec![
            toy("ball", Sphere::default().into(), -1.0),
            toy("box", AABox::default().into(), 1.0),
            EntityDesc::new([above.into(), AreaLight::default().into()]).named("key"),
            EntityDesc::new([robot.into()]).named("robot"),
            EntityDesc::new([on_robot.into()]).named("robot/Head"),
        ],
        ..Scene::default()
    })
}

/// An example as a whole script. A line `EXPRESSION  // VALUE` becomes a check that both are the same; what has a script
/// around it stays as it is.
pub fn runnable(example: &str) -> String {
    if example.lines().any(|line| line.starts_with("animation(")) {
        return example.to_string();
    }
    let line = |line: &str| match line.rsplit_once("//") {
        Some((said, given))
            if !said.trim().is_empty() && !given.trim().is_empty() && !said.trim_end().ends_with(';') =>
        {
            format!("expect({}, {}, {:?});", said.trim(), given.trim(), line)
        }
        _ => line.to_string(),
    };
    let lines: Vec<String> = example.lines().map(line).collect();
    format!(
        "animation(#{{ frames: 5 }});
fn expect(found, given, line) {{
    let same = if type_of(found) == \"Vec3\" {{
        distance(found, given) < 1e-9
    }} else if type_of(found) == \"f64\" {{
        abs(found - given) <= 1e-9
    }} else {{
        found == given
    }};
    if !same {{ throw `${{line}}: found ${{found}}`; }}
}}
fn frame(s, f) {{
{}
}}
",
        lines.join("\n")
    )
}
