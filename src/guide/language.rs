//! What the language of scripts does otherwise than its users would swear; each a script that runs as a test.

use super::{Block, CodeKind};

/// A trap: what is said of it, and lines that show it. What stands behind `//` is what a line gives.
pub const TRAPS: &[(&str, &str)] = &[
    (
        "Numbers with a point compare with a tolerance of about 2e-16, relative to their size: what differs in the last digit \
         is equal, and very small numbers are not above 0.",
        "0.1 * 3 == 0.3          // true\n1e-17 > 0.0             // false",
    ),
    (
        "Infinity is neither equal to 1 nor unequal, nor above it: do not divide by 0 with a point, and ask first.",
        "let inf = 1e308 * 10.0;\ninf > 1.0               // false\ninf != 1.0              // false",
    ),
    (
        "`switch` compares kind and value: 5.0 is not the case 5, though 5.0 == 5. Write the case with a point, or use `if`.",
        "switch 5.0 { 5 => \"whole\", _ => \"other\" }     // \"other\"\n5.0 == 5                // true",
    ),
    (
        "Closures that are made in a loop share its variable, and see the value that it had last. Hand it over through a \
         function.",
        "let calls = [];\nfor i in 0..3 { calls.push(|| i); }\ncalls[0].call()         // 2",
    ),
    (
        "`range` with a step of a fraction may go one step too far, since fractions add up inexactly. Count in whole numbers \
         and divide.",
        "let n = 0;\nfor x in range(0.0, 1.0, 0.1) { n += 1; }\nn                       // 11\n\
         let n = 0;\nfor i in 0..10 { let x = i / 10; n += 1; }\nn                       // 10",
    ),
    (
        "`/` of two whole numbers gives a fraction, and a whole number where it comes out even; `div` gives the whole part. \
         This is so in anim; elsewhere in Rhai, `/` cuts the fraction off.",
        "7 / 2                   // 3.5\n6 / 2                   // 3\ndiv(7, 2)               // 3",
    ),
    (
        "Maps and lists are copied when they are assigned or handed to a function: what a function changes in its copy is not \
         seen outside. Entities, components and the scene are not copied.",
        "let a = [1, 2];\nlet b = a;\nb.push(3);\na.len()                 // 2",
    ),
    (
        "A map that lacks a name gives () for it, without a word, a misspelt column of a row too. `in` asks whether it is \
         there, `??` gives another value.",
        "let m = #{ size: 2 };\nm.colour ?? \"none\"       // \"none\"\n\"size\" in m             // true",
    ),
    (
        "`floor` rounds down, `ceiling` up, `round` to the nearest, halves away from 0, and `int` towards 0; all of them give \
         numbers with a point, and `to_int` gives a whole one. Decimals are kept by way of their power of 10. `%` is the \
         remainder, with the sign of what is divided.",
        "floor(-1.5)             // -2.0\nceiling(1.2)            // 2.0\nround(2.5)              // 3.0\n\
         int(-1.7)               // -1.0\nto_int(1.7)             // 1\nround(3.14159 * 100) / 100      // 3.14\n\
         7 % 3                   // 1\n-7 % 3                  // -1",
    ),
];

/// How a script imports another one; what stands behind `//     ` is the other one.
pub const IMPORTING: &str = "// palette.rhai, beside the script:
//     const GOLD = [0.9, 0.7, 0.4];
//     fn darker(color, share) { vec3(color) * share }
import \"palette\" as palette;
animation(#{ frames: 24 });

fn frame(s, f) {
    s.material(\"brass\").color = palette::darker(palette::GOLD, 1 - 0.5 * f.t);
}";

pub fn blocks() -> Vec<Block> {
    let intro = "Scripts are written in Rhai 1.27, a small language with the looks of Rust and JavaScript. It has a page at \
                 rhai.rs; here is what surprises. A script has no clock, no files but those of its project, no random numbers \
                 but those of a seed, and keeps nothing from frame to frame.";
    let modules = "A script imports others, below the project's root, by their names without the ending: beside the file that \
                   imports them, or else beside the script. Their functions and the constants of their tops are reached by two \
                   colons. What the top of a script or module names is seen by all of its functions.";
    let mut blocks = vec![
        Block::Paragraph(intro.into()),
        Block::Paragraph(modules.into()),
        Block::Code(CodeKind::Script, IMPORTING.into()),
    ];
    for (text, code) in TRAPS {
        blocks.push(Block::Paragraph((*text).into()));
        blocks.push(Block::Code(CodeKind::Script, (*code).into()));
    }
    blocks
}
