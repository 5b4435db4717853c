#include "engine/scene/detail/parts.hpp"
#include "engine/scene/detail/reader.hpp"

#include <cstdio>

namespace cairn::scene_detail {

namespace {

// One side of a joint. Returns false if the file does not say which body it is.
bool read_side(ObjectReader& reader, std::string_view key, const BodyNames& names, Mistakes& mistakes, std::optional<std::size_t>& out) {
    constexpr const char* kRule = "the name of a body, or null for the world";
    const Json* given = reader.value(key, Need::kRequired, kRule);
    if (given == nullptr) return false;
    if (given->is_null()) return true;
    Mistakes::Scope in(mistakes, key);
    if (!given->is_string()) {
        mistakes.add(quoted(*given) + ", must be " + kRule);
        return false;
    }
    const std::string& name = given->get_ref<const std::string&>();
    const BodyNames::const_iterator found = names.find(name);
    if (found == names.end()) {
        std::vector<std::string_view> known;
        for (const auto& [n, unused] : names) known.push_back(n);
        const std::string_view near = nearest_word(name, known);
        mistakes.add(quoted(*given) + ", must be " + kRule + (near.empty() ? "" : "; did you mean \"" + std::string(near) + "\"?"));
        return false;
    }
    out = found->second;
    return true;
}

void check_sides(const SceneJoint& joint, const std::vector<BodyDef>& bodies, Mistakes& mistakes) {
    if (!joint.body_a && !joint.body_b) {
        mistakes.add("body_a and body_b are both the world, must be at least one body");
        return;
    }
    if (joint.body_a == joint.body_b) {
        mistakes.add("body_a and body_b are both " + quoted(Json(bodies[*joint.body_a].name)) + ", must be two bodies");
        return;
    }
    const auto moves = [&](const std::optional<std::size_t>& side) { return side && bodies[*side].type == BodyType::kDynamic; };
    if (!moves(joint.body_a) && !moves(joint.body_b)) mistakes.add("body_a and body_b, must be at least one dynamic body");
}

std::string metres(Real x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3g m", x);
    return text;
}

// An anchor that is too far from the dynamic body it belongs to is a mistake (engine/joint.hpp: kMostJointArm).
void check_arm(std::string_view key, const Vec3& anchor, const std::optional<std::size_t>& side, const std::vector<BodyDef>& bodies,
               Mistakes& mistakes) {
    if (!side || bodies[*side].type != BodyType::kDynamic) return;
    const Real arm = (anchor - bodies[*side].position).stableNorm();
    if (arm <= kMostJointArm) return;
    Mistakes::Scope in(mistakes, key);
    mistakes.add(metres(arm) + " from " + quoted(Json(bodies[*side].name)) + ", must be at most 1e6 m");
}

void read_distance(ObjectReader& reader, SceneJoint& joint, const std::vector<BodyDef>& bodies, Mistakes& mistakes) {
    JointDef& def = joint.def;
    reader.refuse("anchor", "a distance joint has anchor_a and anchor_b instead");
    const bool a = reader.vec3("anchor_a", def.anchor_a, Need::kRequired);
    const bool b = reader.vec3("anchor_b", def.anchor_b, Need::kRequired);
    if (!a || !b) return;
    const Real length = (def.anchor_a - def.anchor_b).stableNorm();
    if (!(length > 0)) mistakes.add("anchor_a and anchor_b are the same point, must be apart");
    if (!(length <= kMostJointArm)) mistakes.add("anchor_a and anchor_b are " + metres(length) + " apart, must be at most 1e6 m");
    check_arm("anchor_a", def.anchor_a, joint.body_a, bodies, mistakes);
    check_arm("anchor_b", def.anchor_b, joint.body_b, bodies, mistakes);
}

}  // namespace

SceneJoint read_joint(const Json& value, const BodyNames& names, const std::vector<BodyDef>& bodies, Mistakes& mistakes) {
    static const std::vector<std::string_view> kNames = {"ball", "hinge", "slider", "fixed", "distance"};
    static const JointType kTypes[] = {JointType::kBall, JointType::kHinge, JointType::kSlider, JointType::kFixed, JointType::kDistance};
    SceneJoint joint;
    JointDef& def = joint.def;
    ObjectReader reader(value, mistakes);
    if (!reader.is_object()) return joint;
    std::size_t type = 0;
    const bool has_type = reader.word("type", kNames, type, Need::kRequired);
    const bool a = read_side(reader, "body_a", names, mistakes, joint.body_a);
    const bool b = read_side(reader, "body_b", names, mistakes, joint.body_b);
    if (a && b) check_sides(joint, bodies, mistakes);
    reader.flag("collide_connected", def.collide_connected, Need::kOptional);
    if (!has_type) return joint;  // without the type nobody knows which other keys belong here
    def.type = kTypes[type];
    if (def.type == JointType::kDistance) {
        read_distance(reader, joint, bodies, mistakes);
    } else {
        if (reader.vec3("anchor", def.anchor_a, Need::kRequired)) {
            check_arm("anchor", def.anchor_a, joint.body_a, bodies, mistakes);
            check_arm("anchor", def.anchor_a, joint.body_b, bodies, mistakes);
        }
        def.anchor_b = def.anchor_a;
        for (const char* key : {"anchor_a", "anchor_b"}) reader.refuse(key, "only a distance joint has one; this one has anchor");
    }
    if (def.type == JointType::kHinge || def.type == JointType::kSlider) {
        reader.axis("axis", def.axis, Need::kRequired);
    } else {
        reader.refuse("axis", "only a hinge or a slider has one");
    }
    reader.finish();
    return joint;
}

}  // namespace cairn::scene_detail
