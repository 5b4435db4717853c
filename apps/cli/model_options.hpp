// Command-line options that choose a model of sequential impulses (solver/si_model.hpp).
#pragma once

#include "engine/settings.hpp"

#include <CLI/CLI.hpp>

#include <nlohmann/json.hpp>

#include <optional>
#include <string>

namespace cairn::cli {

// As given; empty: not given.
struct ModelArguments {
    std::string clamp;
    std::string complementarity;
    std::string warm_start;
    std::string friction;
    std::string order;
    std::string method;
    std::optional<double> relaxation;
};

void add_model_options(CLI::App& command, ModelArguments& arguments);

// Nothing if no option was given. Throws Error naming the option, its value and what would be valid.
std::optional<SiModel> model_from(const ModelArguments& arguments);

// The model by the names that the options have.
nlohmann::ordered_json model_names(const SiModel& model);

const char* stabilisation_name(Stabilisation stabilisation);
// Throws Error if there is none of this name.
Stabilisation stabilisation_from(const std::string& name);

}  // namespace cairn::cli
