#include "apps/cli/model_options.hpp"

#include "engine/base/error.hpp"

#include <cmath>
#include <span>

namespace cairn::cli {

namespace {

template <typename Value>
struct Named {
    const char* name;
    Value value;
};

constexpr Named<Clamp> kClamps[] = {{"none", Clamp::kNone}, {"per-iteration", Clamp::kPerIteration}, {"accumulated", Clamp::kAccumulated}};
constexpr Named<bool> kSwitches[] = {{"on", true}, {"off", false}};
constexpr Named<FrictionModel> kFrictions[] = {{"none", FrictionModel::kNone},
                                               {"one-direction", FrictionModel::kOneDirection},
                                               {"pyramid-fixed", FrictionModel::kPyramidFixed},
                                               {"pyramid", FrictionModel::kPyramid},
                                               {"cone", FrictionModel::kCone}};
constexpr Named<SweepOrder> kOrders[] = {{"joints-first", SweepOrder::kJointsFirst}, {"contacts-first", SweepOrder::kContactsFirst}};
constexpr Named<SweepMethod> kMethods[] = {{"pgs", SweepMethod::kPgs}, {"nncg", SweepMethod::kNncg}};
constexpr Named<Stabilisation> kStabilisations[] = {{"split", Stabilisation::kSplit},
                                                    {"target-velocity", Stabilisation::kTargetVelocity},
                                                    {"none", Stabilisation::kNone},
                                                    {"soft", Stabilisation::kSoft}};

template <typename Value>
const char* name_of(std::span<const Named<Value>> list, Value value) {
    for (const Named<Value>& named : list) {
        if (named.value == value) return named.name;
    }
    return "unknown";
}

// Sets `out` to what `text` names, if it is not empty.
template <typename Value>
void read(const char* option, const std::string& text, std::span<const Named<Value>> list, Value& out) {
    std::string names;
    for (const Named<Value>& named : list) {
        if (text == named.name) {
            out = named.value;
            return;
        }
        names.append(names.empty() ? "" : ", ").append(named.name);
    }
    if (!text.empty()) throw_invalid(option, text, "one of " + names);
}

}  // namespace

void add_model_options(CLI::App& command, ModelArguments& a) {
    const char* group = "Models of --solver si (docs/solvers.md); any of them chooses it";
    const auto add = [&](const char* name, std::string& value, const char* text) { command.add_option(name, value, text)->group(group); };
    add("--clamp", a.clamp, "Bound of normal impulses: accumulated (default: of their sum), per-iteration (of each correction), none");
    add("--complementarity", a.complementarity, "on (default), or off: open gaps are held as if they were closed");
    add("--warm-start", a.warm_start, "on (default), or off: impulses start every substep at zero");
    add("--friction", a.friction,
        "pyramid (default: first tangent along the slip), pyramid-fixed (tangents that stay), cone, one-direction (along the slip alone), "
        "none");
    add("--order", a.order, "joints-first (default) or contacts-first, in each sweep");
    add("--method", a.method, "pgs (default: projected Gauss-Seidel) or nncg (conjugate gradients on top)");
    command.add_option("--relaxation", a.relaxation, "Corrections are taken this many times, > 0 and < 2 (default 1)")->group(group);
}

std::optional<SiModel> model_from(const ModelArguments& a) {
    SiModel model;
    read<Clamp>("--clamp", a.clamp, kClamps, model.clamp);
    read<bool>("--complementarity", a.complementarity, kSwitches, model.complementarity);
    read<bool>("--warm-start", a.warm_start, kSwitches, model.warm_start);
    read<FrictionModel>("--friction", a.friction, kFrictions, model.friction);
    read<SweepOrder>("--order", a.order, kOrders, model.order);
    read<SweepMethod>("--method", a.method, kMethods, model.method);
    if (a.relaxation) {
        if (!(*a.relaxation > 0 && *a.relaxation < 2)) throw_invalid("--relaxation", *a.relaxation, "> 0 and < 2");
        model.relaxation = *a.relaxation;
    }
    const bool given = a.relaxation || !(a.clamp + a.complementarity + a.warm_start + a.friction + a.order + a.method).empty();
    return given ? std::optional<SiModel>(model) : std::nullopt;
}

nlohmann::ordered_json model_names(const SiModel& m) {
    return {{"clamp", name_of<Clamp>(kClamps, m.clamp)},
            {"complementarity", name_of<bool>(kSwitches, m.complementarity)},
            {"warm_start", name_of<bool>(kSwitches, m.warm_start)},
            {"friction", name_of<FrictionModel>(kFrictions, m.friction)},
            {"order", name_of<SweepOrder>(kOrders, m.order)},
            {"method", name_of<SweepMethod>(kMethods, m.method)},
            {"relaxation", m.relaxation}};
}

const char* stabilisation_name(Stabilisation stabilisation) {
    return name_of<Stabilisation>(kStabilisations, stabilisation);
}

Stabilisation stabilisation_from(const std::string& name) {
    Stabilisation stabilisation = Stabilisation::kSplit;
    read<Stabilisation>("--stabilisation", name, kStabilisations, stabilisation);
    return stabilisation;
}

}  // namespace cairn::cli
