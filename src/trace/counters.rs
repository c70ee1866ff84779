//! What a frame cost: counters per worker, added up at the end.

/// Numbers of rays and of the work they made. Sums do not depend on the order of addition.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Rays from the camera.
    pub primary_rays: u64,
    /// Those of them that met something.
    pub primary_hits: u64,
    /// Rays towards lights.
    pub shadow_rays: u64,
    /// Those of them that were stopped.
    pub shadow_hits: u64,
    /// Rays off mirrors and gloss.
    pub reflection_rays: u64,
    /// Rays through glass.
    pub refraction_rays: u64,
    /// Rays of paths that left a diffuse surface.
    pub diffuse_rays: u64,
    /// Rays of photons.
    pub photon_rays: u64,
    /// Ray-primitive tests, those on infinite planes included.
    pub intersection_tests: u64,
    /// Cells or nodes visited.
    pub steps: u64,
}

impl std::ops::AddAssign for Counters {
    fn add_assign(&mut self, other: Self) {
        self.primary_rays += other.primary_rays;
        self.primary_hits += other.primary_hits;
        self.shadow_rays += other.shadow_rays;
        self.shadow_hits += other.shadow_hits;
        self.reflection_rays += other.reflection_rays;
        self.refraction_rays += other.refraction_rays;
        self.diffuse_rays += other.diffuse_rays;
        self.photon_rays += other.photon_rays;
        self.intersection_tests += other.intersection_tests;
        self.steps += other.steps;
    }
}
