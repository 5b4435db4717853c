// The parts of a scene file. Each reads one value at the current place, notes its mistakes and returns what it could make of it; the caller
// uses the result only if there was no mistake in the whole file.
#pragma once

#include "engine/body.hpp"
#include "engine/scene/detail/json_document.hpp"
#include "engine/scene/detail/mistakes.hpp"
#include "engine/scene/scene.hpp"

#include <map>
#include <optional>
#include <string>

namespace cairn::scene_detail {

std::optional<Shape> read_shape(const Json& value, Mistakes& mistakes);
BodyDef read_body(const Json& value, Mistakes& mistakes);

using BodyNames = std::map<std::string, std::size_t, std::less<>>;  // name to index into Scene::bodies
SceneJoint read_joint(const Json& value, const BodyNames& names, const std::vector<BodyDef>& bodies, Mistakes& mistakes);

}  // namespace cairn::scene_detail
