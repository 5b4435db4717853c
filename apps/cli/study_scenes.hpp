// Scenes of the studies: the shipped ones (tests/scenes/sheet_*.json) and families of them.
#pragma once

#include "engine/scene/scene.hpp"

#include <string>

namespace cairn::cli {

// A shipped scene by its name.
Scene sheet_scene(const std::string& name);

// `count` boxes of edge 1 m and mass 1 kg, each shifted by `shift` [m] along x against the one below; ground with friction `mu`.
Scene box_stack(int count, Real shift = 0, Real mu = 0.6);

// A box of 1 kg with one of `ratio` kg on it.
Scene heavy_on_light(Real ratio);

// The shipped scene with the box launched at `angle` [rad] from where the file has it, and turned likewise about z.
Scene launched(const Scene& scene, Real angle);

// Index of the body of this name. Throws Error if there is none.
std::size_t body_index(const Scene& scene, const std::string& name);

}  // namespace cairn::cli
