#include "collision/mass_properties.hpp"
#include "collision/shape.hpp"
#include "engine/scene/detail/parts.hpp"
#include "engine/scene/detail/reader.hpp"

#include <algorithm>
#include <cmath>

namespace cairn::scene_detail {

namespace {

// Names stand in the states file, one to a field, unquoted.
void read_name(ObjectReader& reader, BodyDef& body, Mistakes& mistakes) {
    if (!reader.text("name", body.name, Need::kRequired)) return;
    Mistakes::Scope in(mistakes, std::string_view("name"));
    if (body.name.empty()) mistakes.add("\"\", must not be empty");
    const auto unfit = [](unsigned char c) { return c == ',' || c == '"' || c < 0x20 || c == 0x7f; };
    if (std::any_of(body.name.begin(), body.name.end(), unfit)) {
        mistakes.add(quoted(Json(body.name)) + ", must be without commas, double quotes, line breaks and control characters");
    }
}

// Principal moments of a body with mass: all > 0, and none larger than the other two together (equality is a flat body).
void read_inertia(ObjectReader& reader, BodyDef& body, Mistakes& mistakes) {
    Vec3 I;
    if (!reader.vec3("inertia", I, Need::kOptional, Range::kPositive)) return;
    Mistakes::Scope in(mistakes, std::string_view("inertia"));
    body.inertia = I;
    constexpr Real kTolerance = 1e-6;  // relative: a thin plate's moments written with seven digits pass
    const Real largest = I.maxCoeff();
    if (largest - (I.sum() - largest) > kTolerance * largest) {
        mistakes.add(quoted(Json{I.x(), I.y(), I.z()}) + ", must have no moment larger than the sum of the other two");
    }
}

std::optional<RotateSine> read_motion(const Json& value, Mistakes& mistakes) {
    const std::size_t before = mistakes.count();
    ObjectReader reader(value, mistakes);
    RotateSine motion;
    std::size_t type = 0;
    reader.word("type", {"rotate_sine"}, type, Need::kRequired);
    reader.axis("axis", motion.axis, Need::kRequired);
    reader.number("amplitude", motion.amplitude, Range::kAny, Need::kRequired);
    reader.number("period", motion.period, Range::kPositive, Need::kRequired);
    reader.number("phase", motion.phase, Range::kAny, Need::kOptional);
    reader.finish();
    if (mistakes.count() != before) return {};
    return motion;
}

// What only some body types may have. `type` is nothing when the file's own is not one of the three.
void read_by_type(ObjectReader& reader, const std::optional<BodyType>& type, BodyDef& body, Mistakes& mistakes) {
    const std::string only_dynamic = "only a dynamic body has one";
    if (type == BodyType::kDynamic) {
        reader.number("mass", body.mass, Range::kPositive, Need::kRequired);
        read_inertia(reader, body, mistakes);
        reader.vec3("force", body.force, Need::kOptional);
        reader.vec3("torque", body.torque, Need::kOptional);
    } else if (type) {
        for (const char* key : {"mass", "inertia", "force", "torque"}) reader.refuse(key, only_dynamic);
    }
    if (type == BodyType::kKinematic) {
        if (const Json* motion = reader.value("motion", Need::kOptional, "an object")) {
            Mistakes::Scope in(mistakes, std::string_view("motion"));
            body.motion = read_motion(*motion, mistakes);
        }
    } else if (type) {
        reader.refuse("motion", "only a kinematic body has one");
    }
    reader.vec3("linear_velocity", body.linear_velocity, Need::kOptional);
    reader.vec3("angular_velocity", body.angular_velocity, Need::kOptional);
    if (type == BodyType::kStatic) {
        for (const char* key : {"linear_velocity", "angular_velocity"}) {
            const Vec3& v = key[0] == 'l' ? body.linear_velocity : body.angular_velocity;
            if (v.isZero(0)) continue;
            Mistakes::Scope in(mistakes, std::string_view(key));
            mistakes.add(quoted(Json{v.x(), v.y(), v.z()}) + ", must be zero: a static body does not move");
        }
    }
    if (!type) {  // the keys are known all the same
        for (const char* key : {"mass", "inertia", "force", "torque", "motion"}) reader.value(key, Need::kOptional, "");
    }
}

// True if every shape could be read.
bool read_shapes(ObjectReader& reader, const std::optional<BodyType>& type, BodyDef& body, Mistakes& mistakes) {
    const Json* list = reader.list("shapes", Need::kRequired, "shapes");
    if (list == nullptr) return false;
    bool all = true;
    Mistakes::Scope in(mistakes, std::string_view("shapes"));
    for (std::size_t i = 0; i < list->size(); ++i) {
        Mistakes::Scope at(mistakes, i);
        std::optional<Shape> shape = read_shape((*list)[i], mistakes);
        if (!shape) {
            all = false;
        } else if (shape->is_static_only() && type && type != BodyType::kStatic) {
            mistakes.add(std::string(shape->type == ShapeType::kPlane ? "a plane" : "a mesh") + ", must be on a static body");
            all = false;
        } else {
            body.shapes.push_back(std::move(*shape));
        }
    }
    return all;
}

// Without `inertia` the shapes must give it, about the body's origin.
void check_default_inertia(const BodyDef& body, Mistakes& mistakes) {
    Mistakes::Scope in(mistakes, std::string_view("inertia"));
    if (body.shapes.empty()) {
        mistakes.add("missing, must be given for a dynamic body without shapes");
        return;
    }
    const VolumeProperties volume = volume_properties(body.shapes);
    // The same rule as World::add_body's: a ten-thousandth of the radius of gyration.
    constexpr Real kTolerance = 1e-4;
    const Real size = std::sqrt(volume.inertia.trace() / volume.volume);
    if (volume.centroid.norm() <= kTolerance * size) return;
    const Vec3 c = volume.centroid;
    mistakes.add("missing, must be given: the shapes' centroid " + quoted(Json{c.x(), c.y(), c.z()}) + " is not the body's origin");
}

}  // namespace

BodyDef read_body(const Json& value, Mistakes& mistakes) {
    BodyDef body;
    ObjectReader reader(value, mistakes);
    if (!reader.is_object()) return body;
    read_name(reader, body, mistakes);
    const std::vector<std::string_view> names = {"static", "dynamic", "kinematic"};
    const BodyType types[] = {BodyType::kStatic, BodyType::kDynamic, BodyType::kKinematic};
    std::optional<BodyType> type;
    std::size_t index = 0;
    if (reader.word("type", names, index, Need::kRequired)) type = types[index];
    if (type) body.type = *type;
    reader.vec3("position", body.position, Need::kRequired);
    reader.rotation("rotation", body.rotation, Need::kOptional);
    read_by_type(reader, type, body, mistakes);
    const bool shapes_read = read_shapes(reader, type, body, mistakes);
    if (type == BodyType::kDynamic && shapes_read && !reader.has("inertia")) check_default_inertia(body, mistakes);
    reader.number("friction", body.friction, Range::kNotNegative, Need::kOptional);
    reader.number("restitution", body.restitution, Range::kNotNegative, Need::kOptional);
    reader.number("torsional_friction", body.torsional_friction, Range::kNotNegative, Need::kOptional);
    reader.number("rolling_friction", body.rolling_friction, Range::kNotNegative, Need::kOptional);
    reader.finish();
    return body;
}

}  // namespace cairn::scene_detail
