//! Where things go: circles, and rotations that look at something.
//!
//! One sense of rotation: seen from above, angles grow counter-clockwise. 0 degrees is +x, 90 degrees is -z. `yaw`,
//! `polar` and `orbit` agree in it: what stands on +x and is turned by `yaw` lies at `polar(radius, yaw)`.

use ::rhai::Dynamic;
use glam::{DMat3, DVec3};

use super::convert::{number, vector};
use super::errors::Fallible;
use super::table::{Chapter, Function};
use crate::base::math::{euler_degrees, look_at_degrees, rotation_matrix, sin_cos_degrees};

/// Rotation that turns the local -y axis, the face of an area light, from one point towards another.
fn aim(from: DVec3, at: DVec3) -> DVec3 {
    let down = (at - from).normalize_or(DVec3::NEG_Y);
    let right = down.cross(DVec3::Z).try_normalize().unwrap_or(DVec3::X);
    // Local x, y, z go to right, -down and their cross product.
    euler_degrees(DMat3::from_cols(right, -down, right.cross(-down)))
}

pub fn polar(radius: f64, degrees: f64, y: f64) -> DVec3 {
    let (sin, cos) = sin_cos_degrees(degrees);
    DVec3::new(radius * cos, y, -(radius * sin))
}

fn orbit(center: &Dynamic, radius: &Dynamic, turns: &Dynamic, tilt: f64) -> Fallible<DVec3> {
    let around = polar(number(radius)?, 360.0 * number(turns)?, 0.0);
    let tilted = if tilt == 0.0 { around } else { rotation_matrix(DVec3::X * tilt) * around };
    Ok(vector(center)? + tilted)
}

pub const CHAPTER: Chapter = Chapter {
    title: "Places and directions",
    functions: &[
        Function {
            name: "polar",
            forms: &["polar(radius, degrees) -> vector", "polar(radius, degrees, y) -> vector"],
            text: "A point on a circle about the y axis. Seen from above the angle grows counter-clockwise, as `yaw` does: 0 is \
                   +x, 90 is -z, 180 is -x.",
            arguments: &[
                ("radius", "world units"),
                ("degrees", "any number"),
                ("y", "height, world units; 0 if left out"),
            ],
            example: "polar(2, 0)          // vec3(2, 0, 0)\n\
                      polar(2, 90, 1)      // vec3(0, 1, -2)",
            register: |engine| {
                engine
                    .register_fn("polar", |r: Dynamic, a: Dynamic| -> Fallible<DVec3> {
                        Ok(polar(number(&r)?, number(&a)?, 0.0))
                    })
                    .register_fn("polar", |r: Dynamic, a: Dynamic, y: Dynamic| -> Fallible<DVec3> {
                        Ok(polar(number(&r)?, number(&a)?, number(&y)?))
                    });
            },
        },
        Function {
            name: "orbit",
            forms: &["orbit(center, radius, turns) -> vector", "orbit(center, radius, turns, tilt) -> vector"],
            text: "A point on a circle around another, counter-clockwise seen from above as `yaw` and `polar`: it starts on +x, \
                   and a quarter of a turn later is on -z.",
            arguments: &[
                ("center", "a point, world units"),
                ("radius", "world units"),
                ("turns", "whole turns: 1 is once around"),
                ("tilt", "degrees that the circle is turned by about the x axis; 0 if left out"),
            ],
            example: "orbit([0, 1, 0], 2, 0.25)          // vec3(0, 1, -2)\n\
                      orbit([0, 0, 0], 2, 0.25, 90)      // vec3(0, 2, 0)",
            register: |engine| {
                engine
                    .register_fn("orbit", |c: Dynamic, r: Dynamic, turns: Dynamic| orbit(&c, &r, &turns, 0.0))
                    .register_fn("orbit", |c: Dynamic, r: Dynamic, turns: Dynamic, tilt: Dynamic| {
                        orbit(&c, &r, &turns, number(&tilt)?)
                    });
            },
        },
        Function {
            name: "look_at",
            forms: &["look_at(from, at) -> rotation", "look_at(from, at, up) -> rotation"],
            text: "The rotation (pitch, yaw, roll in degrees) that turns the -z axis of what stands at one point towards \
                   another, with its +y axis as near to `up` as may be.",
            arguments: &[
                ("from", "a point, world units"),
                ("at", "another point, world units"),
                ("up", "a direction; [0, 1, 0] if left out"),
            ],
            example: "look_at([0, 0, 5], [0, 0, 0])       // vec3(0, 0, 0)\n\
                      look_at([0, 0, 0], [-3, 0, 0])      // vec3(0, 90, 0)",
            register: |engine| {
                engine
                    .register_fn("look_at", |from: Dynamic, at: Dynamic| -> Fallible<DVec3> {
                        Ok(look_at_degrees(vector(&from)?, vector(&at)?, DVec3::Y))
                    })
                    .register_fn("look_at", |from: Dynamic, at: Dynamic, up: Dynamic| -> Fallible<DVec3> {
                        Ok(look_at_degrees(vector(&from)?, vector(&at)?, vector(&up)?))
                    });
            },
        },
        Function {
            name: "aim",
            forms: &["aim(from, at) -> rotation"],
            text: "The rotation (pitch, yaw, roll in degrees) that turns the -y axis, the face of an area light, from one point \
                   towards another.",
            arguments: &[("from", "a point, world units"), ("at", "another point, world units")],
            example: "let lamp = s.get(\"key\");\n\
                      lamp.rotation = aim(lamp.translation, [0, 0.5, 0]);",
            register: |engine| {
                engine.register_fn("aim", |from: Dynamic, at: Dynamic| -> Fallible<DVec3> {
                    Ok(aim(vector(&from)?, vector(&at)?))
                });
            },
        },
    ],
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_aimed_light_faces_its_target() {
        for (from, at) in
            [([0.0, 3.0, 0.0], [0.0; 3]), ([1.0, 2.0, 3.0], [-1.0, 0.5, 0.0]), ([0.0, 0.0, -4.0], [0.0; 3])]
        {
            let (from, at) = (DVec3::from_array(from), DVec3::from_array(at));
            let face = rotation_matrix(aim(from, at)) * DVec3::NEG_Y;
            assert!((face - (at - from).normalize()).length() < 1e-6, "{from} {face}");
        }
    }

    #[test]
    fn yaw_polar_and_orbit_turn_the_same_way() {
        for degrees in [0.0, 30.0, 90.0, 200.0, -45.0] {
            let turned = rotation_matrix(DVec3::Y * degrees) * DVec3::new(3.0, 0.0, 0.0);
            assert!((turned - polar(3.0, degrees, 0.0)).length() < 1e-12, "{degrees}");
            let around = orbit(&Dynamic::from(DVec3::ZERO), &3.0.into(), &(degrees / 360.0).into(), 0.0).unwrap();
            assert!((turned - around).length() < 1e-9, "{degrees}");
        }
    }
}
