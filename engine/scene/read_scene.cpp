#include "engine/scene/detail/parts.hpp"
#include "engine/scene/detail/reader.hpp"
#include "engine/scene/scene.hpp"

#include "engine/base/error.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace cairn {

namespace {

using namespace scene_detail;

void read_head(ObjectReader& reader, Scene& scene, Mistakes& mistakes) {
    std::string format;
    if (reader.text("format", format, Need::kRequired) && format != "scene/1") {
        Mistakes::Scope in(mistakes, std::string_view("format"));
        mistakes.add(quoted(Json(format)) + ", must be \"scene/1\"");
    }
    if (reader.text("name", scene.name, Need::kRequired) && scene.name.empty()) {
        Mistakes::Scope in(mistakes, std::string_view("name"));
        mistakes.add("\"\", must not be empty");
    }
    reader.text("description", scene.description, Need::kOptional);
    reader.vec3("gravity", scene.gravity, Need::kOptional);
    reader.number("duration", scene.duration, Range::kPositive, Need::kRequired);
    reader.number("sample_interval", scene.sample_interval, Range::kPositive, Need::kRequired);
}

BodyNames read_bodies(ObjectReader& reader, Scene& scene, Mistakes& mistakes) {
    BodyNames names;
    const Json* list = reader.list("bodies", Need::kRequired, "bodies");
    if (list == nullptr) return names;
    Mistakes::Scope in(mistakes, std::string_view("bodies"));
    for (std::size_t i = 0; i < list->size(); ++i) {
        Mistakes::Scope at(mistakes, i);
        scene.bodies.push_back(read_body((*list)[i], mistakes));
        const std::string& name = scene.bodies.back().name;
        if (name.empty()) continue;
        const auto [first, is_new] = names.emplace(name, i);
        if (is_new) continue;
        Mistakes::Scope of(mistakes, std::string_view("name"));
        mistakes.add(quoted(Json(name)) + ", must be used once: bodies[" + std::to_string(first->second) + "] has it too");
    }
    return names;
}

void read_joints(ObjectReader& reader, const BodyNames& names, Scene& scene, Mistakes& mistakes) {
    const Json* list = reader.list("joints", Need::kOptional, "joints");
    if (list == nullptr) return;
    Mistakes::Scope in(mistakes, std::string_view("joints"));
    for (std::size_t i = 0; i < list->size(); ++i) {
        Mistakes::Scope at(mistakes, i);
        scene.joints.push_back(read_joint((*list)[i], names, scene.bodies, mistakes));
    }
}

// For a judge, not for an engine: only the form is looked at.
void read_checks(ObjectReader& reader, Mistakes& mistakes) {
    const Json* list = reader.list("checks", Need::kOptional, "checks");
    if (list == nullptr) return;
    Mistakes::Scope in(mistakes, std::string_view("checks"));
    for (std::size_t i = 0; i < list->size(); ++i) {
        Mistakes::Scope at(mistakes, i);
        ObjectReader check((*list)[i], mistakes);
        std::string metric;
        check.text("metric", metric, Need::kRequired);
    }
}

std::string read_file(const std::string& path) {
    std::error_code ignored;
    if (std::filesystem::is_directory(path, ignored)) throw Error(path + ": is a folder, must be a scene file");
    std::ifstream file(path, std::ios::binary);
    if (!file) throw Error(path + ": cannot be read: " + std::strerror(errno));
    std::ostringstream text;
    text << file.rdbuf();
    if (file.bad()) throw Error(path + ": cannot be read to its end");
    return std::move(text).str();
}

}  // namespace

Scene load_scene(const std::string& path) {
    return parse_scene(read_file(path), path);
}

Scene parse_scene(const std::string& text, const std::string& source) {
    Mistakes mistakes(source);
    if (text.find_first_not_of(" \t\r\n") == std::string::npos) throw Error(source + ": is empty, must be a scene");
    Json document;
    if (!parse_json(text, mistakes, document)) mistakes.throw_if_any();
    Scene scene;
    ObjectReader reader(document, mistakes);
    if (reader.is_object()) {
        read_head(reader, scene, mistakes);
        const BodyNames names = read_bodies(reader, scene, mistakes);
        read_joints(reader, names, scene, mistakes);
        read_checks(reader, mistakes);
        reader.finish();
    }
    mistakes.throw_if_any();
    return scene;
}

}  // namespace cairn
