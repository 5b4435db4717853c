// Scene texts for the tests: a whole scene around the part that a test is about.
#pragma once

#include "engine/base/error.hpp"
#include "engine/scene/scene.hpp"

#include <string>

namespace scene_text {

inline std::string scene(const std::string& bodies, const std::string& joints = "") {
    return R"({"format": "scene/1", "name": "s", "duration": 1, "sample_interval": 0.5, "bodies": [)" + bodies + R"(], "joints": [)" +
           joints + "]}";
}

// A dynamic unit ball with `more` keys after it.
inline std::string ball(const std::string& name, const std::string& more = "") {
    return R"({"name": ")" + name +
           R"(", "type": "dynamic", "mass": 1, "position": [0, 0, 0], "shapes": [{"type": "sphere", "radius": 1}])" +
           (more.empty() ? "" : ", " + more) + "}";
}

inline std::string fixed(const std::string& shape, const std::string& more = "") {
    return R"({"name": "ground", "type": "static", "position": [0, 0, 0], "shapes": [)" + shape + "]" + (more.empty() ? "" : ", " + more) +
           "}";
}

// A dynamic body of mass 2 with one shape.
inline std::string shaped(const std::string& shape, const std::string& more = "") {
    return R"({"name": "b", "type": "dynamic", "mass": 2, "position": [0, 0, 0], "shapes": [)" + shape + "]" +
           (more.empty() ? "" : ", " + more) + "}";
}

inline cairn::Scene parse(const std::string& text) {
    return cairn::parse_scene(text, "file");
}

// What the reader says of a text; empty: nothing is wrong.
inline std::string mistakes(const std::string& text) {
    try {
        parse(text);
    } catch (const cairn::Error& error) {
        return error.what();
    }
    return {};
}

}  // namespace scene_text
