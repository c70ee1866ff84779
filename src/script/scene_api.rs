//! The scene in the hands of a script: what is registered for it, its entities and its components.

use ::rhai::{Array, Dynamic, Engine, ImmutableString, Map};

use super::cameras;
use super::handles::{EntityHandle, RecordHandle, SceneHandle};
use super::table::{Chapter, Function};

/// The entities of a scene by name: `s.get("hero")`.
#[derive(Clone)]
struct EntityLookup(SceneHandle);

/// The materials of a scene by name: `s.material("brass")`.
#[derive(Clone)]
struct MaterialLookup(SceneHandle);

fn handles(list: Vec<EntityHandle>) -> Array {
    list.into_iter().map(Dynamic::from).collect()
}

/// Types, and access to their fields by name.
fn types(engine: &mut Engine) {
    engine
        .register_type_with_name::<SceneHandle>("Scene")
        .register_set("render", |_: &mut SceneHandle, _: RecordHandle| {})
        .register_type_with_name::<EntityHandle>("Entity")
        .register_indexer_get(|e: &mut EntityHandle, property: ImmutableString| e.get(&property))
        .register_indexer_set(|e: &mut EntityHandle, property: ImmutableString, value: Dynamic| e.set(&property, value))
        .register_type_with_name::<RecordHandle>("Component")
        .register_indexer_get(|r: &mut RecordHandle, field: ImmutableString| r.get(&field))
        .register_indexer_set(|r: &mut RecordHandle, field: ImmutableString, value: Dynamic| r.set(&field, value));
    // `s.get("hero")` and `s.material("brass")` where something is assigned to them: see `rewrite`.
    engine
        .register_get("get", |s: &mut SceneHandle| EntityLookup(s.clone()))
        .register_set("get", |_: &mut SceneHandle, _: EntityLookup| {})
        .register_indexer_get(|all: &mut EntityLookup, name: ImmutableString| all.0.get(&name))
        .register_indexer_set(|_: &mut EntityLookup, _: ImmutableString, _: EntityHandle| {})
        .register_get("material", |s: &mut SceneHandle| MaterialLookup(s.clone()))
        .register_set("material", |_: &mut SceneHandle, _: MaterialLookup| {})
        .register_indexer_get(|all: &mut MaterialLookup, name: ImmutableString| all.0.material(&name))
        .register_indexer_set(|_: &mut MaterialLookup, _: ImmutableString, _: RecordHandle| {});
}

pub const CHAPTER: Chapter = Chapter {
    title: "The scene",
    functions: &[
        Function {
            name: "camera",
            forms: &["s.camera -> component"],
            text: "The camera that the frame is seen from: its fields are those of `camera` in a scene, read and written by \
                   name. Assigning the name of one of the scene's `cameras` cuts to it; from then on `s.camera` is that one. \
                   `\"camera\"` is the scene's `camera` itself. What `setup` chooses is what all frames start from.",
            arguments: &[],
            example: "s.camera.fov = 35;\ns.camera.from += [0, 0.1, 0];\ns.camera.fov          // 35.0",
            register: |engine| {
                types(engine);
                engine
                    .register_get("camera", |s: &mut SceneHandle| s.camera_record())
                    .register_set("camera", cameras::choose);
            },
        },
        Function {
            name: "render",
            forms: &["s.render -> component"],
            text: "The settings of the picture: its fields are those of `render` in a scene.",
            arguments: &[],
            example: "s.render.exposure = 0.5;\ns.render.background = [0.1, 0.1, 0.2];",
            register: |engine| {
                engine.register_get("render", |s: &mut SceneHandle| s.render_record());
            },
        },
        Function {
            name: "get",
            forms: &["s.get(name) -> entity"],
            text: "The entity of a name. Its properties: `translation rotation scale parent` of its transform, `yaw pitch roll` \
                   in degrees, `name`, `tags`, `material` (a name), `color` of its light, and every component by name, as \
                   in `e.sphere.radius`. Assigning () to a component takes it off.",
            arguments: &[("name", "a text: as in the scene, or as it was spawned with")],
            example: "s.get(\"ball\").translation.y = 1.5;\n\
                      s.get(\"ball\").yaw = 360 * f.t;\n\
                      s.get(\"ball\").sphere.radius = 0.5;\n\
                      s.get(\"key\").color = [2, 1.8, 1.5];",
            register: |engine| {
                engine.register_fn("get", SceneHandle::get);
            },
        },
        Function {
            name: "has",
            forms: &["s.has(name) -> bool"],
            text: "Whether there is an entity of a name.",
            arguments: &[("name", "a text")],
            example: "s.has(\"ball\")         // true\ns.has(\"nobody\")       // false",
            register: |engine| {
                engine.register_fn("has", |s: &mut SceneHandle, name: &str| s.has(name));
            },
        },
        Function {
            name: "material",
            forms: &["s.material(name) -> component"],
            text: "The material of a name: its fields are those of a material in a scene. All that wear it change with it.",
            arguments: &[("name", "a text: as in the scene, or as it was added with")],
            example: "s.material(\"brass\").roughness = lerp(0.1, 0.5, f.t);\n\
                      s.material(\"brass\").color = [0.9, 0.7, 0.4];",
            register: |engine| {
                engine.register_fn("material", SceneHandle::material);
            },
        },
        Function {
            name: "add_material",
            forms: &["s.add_material(name, fields) -> component"],
            text: "Adds a material.",
            arguments: &[
                ("name", "a text that no other material has"),
                ("fields", "a map of the fields of a material that differ from their defaults"),
            ],
            example: "s.add_material(\"jade\", #{ color: [0.2, 0.6, 0.4], specular: 0.5 });\n\
                      s.get(\"ball\").material = \"jade\";",
            register: |engine| {
                engine.register_fn("add_material", SceneHandle::add_material);
            },
        },
        Function {
            name: "spawn",
            forms: &["s.spawn(parts) -> entity"],
            text: "Adds an entity. In `setup` it is there for all frames, in `frame` for this one.",
            arguments: &[(
                "parts",
                "a map: `name`, `tags`, and whatever an entity has as properties and components, as for `get`",
            )],
            example: "let moon = s.spawn(#{ name: \"moon\", sphere: #{ radius: 0.2 }, translation: polar(3, 90), material: \"brass\" });\n\
                      moon.translation        // vec3(0, 0, -3)",
            register: |engine| {
                engine.register_fn("spawn", |s: &mut SceneHandle, parts: Map| s.spawn(parts));
            },
        },
        Function {
            name: "despawn",
            forms: &["s.despawn(entity)"],
            text: "Removes an entity, and with it what stands in its space; in `frame` for this one frame.",
            arguments: &[("entity", "an entity, as `get` and `spawn` give it")],
            example: "s.despawn(s.get(\"box\"));\ns.has(\"box\")       // false",
            register: |engine| {
                engine.register_fn("despawn", |s: &mut SceneHandle, entity: EntityHandle| s.despawn(&entity));
            },
        },
        Function {
            name: "entities",
            forms: &["s.entities() -> list of entities"],
            text: "All entities, in the order of the scene and then of their spawning.",
            arguments: &[],
            example: "for e in s.entities() { e.translation.y += 0.1; }",
            register: |engine| {
                engine.register_fn("entities", |s: &mut SceneHandle| handles(s.entities(None)));
            },
        },
        Function {
            name: "tagged",
            forms: &["s.tagged(tag) -> list of entities"],
            text: "All entities that have a tag, in their order.",
            arguments: &[("tag", "a text")],
            example: "for e in s.tagged(\"toy\") { e.yaw = 90 * f.t; }\ns.tagged(\"toy\").len()     // 2",
            register: |engine| {
                engine.register_fn("tagged", |s: &mut SceneHandle, tag: &str| handles(s.entities(Some(tag))));
            },
        },
        Function {
            name: "rng",
            forms: &["s.rng -> generator"],
            text: "Random numbers of `setup`; in `frame` those of the frame.",
            arguments: &[],
            example: "s.rng.float() < 1.0       // true",
            register: |engine| {
                engine.register_get("rng", |s: &mut SceneHandle| s.rng());
            },
        },
    ],
};
