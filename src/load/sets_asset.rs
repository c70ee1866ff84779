//! A mesh file as an asset: each group, or each object, of an OBJ is a node; a PLY or STL is one.

use super::asset::AssetFile;
use super::mesh;
use super::names::Names;
use super::resolve::Problem;
use super::spans::Step;
use crate::base::diagnostics::Diagnostic;
use crate::base::project::Folder;
use crate::components::*;

/// Reads a mesh file for the names of its sets; the entities that have them read it as meshes do, materials and all.
///
/// `path` is where the scene names the file.
///
/// # Errors
/// What is wrong in the file.
pub fn read(base: &Folder, file: &Text, path: Vec<Step>) -> Result<AssetFile, Problem> {
    let loaded = mesh::load(base, file, false).map_err(|problem| Problem::from_file(path, problem))?;
    let data = &loaded.data;
    let sets = partition(&data.groups, data.triangles.len());
    let mut warnings = Vec::new();
    if sets.is_none() && !data.groups.is_empty() {
        let message = format!("{file}: its groups overlap or leave faces out, so that it is one node");
        warnings.push(Diagnostic::warning(message).help("give each face one group, or name one by mesh: (group: ...)"));
    }
    let mut names = Names::default();
    let node = |name: &str, group: Option<Text>, names: &mut Names| {
        let mesh = Mesh { file: Some(file.clone()), group, ..Mesh::default() };
        AssetNode { name: names.give(name), parent: None, desc: EntityDesc::new([mesh.into()]) }
    };
    let nodes = match sets {
        Some(sets) => sets.iter().map(|set| node(&set.name, Some(set.name.clone()), &mut names)).collect(),
        None => vec![node("mesh", None, &mut names)],
    };
    Ok(AssetFile { nodes, materials: Vec::new(), clips: Vec::new(), warnings })
}

/// The sets that have each triangle once, in the order of the file; the smaller ones where some are within others. `None`
/// if there are no such sets.
fn partition(sets: &[FaceSet], triangles: usize) -> Option<Vec<&FaceSet>> {
    let mut order: Vec<usize> = (0..sets.len()).collect();
    order.sort_by_key(|i| sets[*i].triangles().count());
    let small_first = chosen(sets, &order, triangles);
    small_first.or_else(|| {
        order.reverse();
        chosen(sets, &order, triangles)
    })
}

/// The sets, taken in an order, that share no triangle with those before; `None` if they leave triangles out.
fn chosen<'a>(sets: &'a [FaceSet], order: &[usize], triangles: usize) -> Option<Vec<&'a FaceSet>> {
    let mut taken = vec![false; triangles];
    let mut chosen = Vec::new();
    for i in order {
        let set = &sets[*i];
        if set.triangles().next().is_some() && set.triangles().all(|t| !taken[t as usize]) {
            set.triangles().for_each(|t| taken[t as usize] = true);
            chosen.push(*i);
        }
    }
    chosen.sort_unstable();
    let whole = !chosen.is_empty() && taken.iter().all(|taken| *taken);
    whole.then(|| chosen.into_iter().map(|i| &sets[i]).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_face_is_in_one_node() {
        let set = |name: &str, runs: &[[u32; 2]]| FaceSet { name: name.into(), runs: runs.to_vec() };
        let names = |sets: &[FaceSet], triangles| -> Option<Vec<String>> {
            partition(sets, triangles).map(|sets| sets.iter().map(|set| set.name.to_string()).collect())
        };
        let (body, lid) = (set("body", &[[0, 3]]), set("lid", &[[3, 5]]));
        let vase = set("vase", &[[0, 5]]);
        assert_eq!(names(&[vase.clone(), body.clone(), lid.clone()], 5).unwrap(), ["body", "lid"]);
        assert_eq!(names(&[vase.clone(), lid.clone()], 5).unwrap(), ["vase"]);
        assert_eq!(names(&[lid, body.clone()], 5).unwrap(), ["lid", "body"]);
        assert_eq!(names(&[body], 5), None);
        assert_eq!(names(&[], 5), None);
    }
}
