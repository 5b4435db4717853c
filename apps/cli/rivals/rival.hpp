// What an engine must offer to run our scenes: one small interface, so that Cairn and others are driven, sampled and timed by the same
// loop. Adapters of other engines are modules of their own (module.hpp), loaded when they are asked for: the program links none of them,
// and the single and double precision builds of one engine, whose symbols have the same names, live in one process.
#pragma once

#include "engine/base/error.hpp"
#include "engine/scene/scene.hpp"

#include <optional>
#include <string>
#include <vector>

namespace cairn::cli {

// What a run asks of an engine. What is not given is the engine's own default.
struct RivalOptions {
    std::optional<int> substeps;    // of a step, >= 1; default for engines that have no such thing of their own: 1
    std::optional<int> iterations;  // sweeps of its solver, where it has sweeps
    bool sleep = false;
    std::string variant;  // of the engine, as in "worldstep"; empty: the engine as it comes
};

// Thrown by an adapter when the scene asks for what its engine lacks: that is no failure of the engine.
class Unsupported : public Error {
public:
    using Error::Error;
};

class Rival {
public:
    virtual ~Rival() = default;

    virtual std::string version() const = 0;
    virtual int precision() const = 0;         // bits of its scalar: 32 or 64
    virtual std::string settings() const = 0;  // in words: everything that was set or that matters, as in "10 iterations, erp 0.2"

    // Advances by dt [s], in as many substeps as were asked for. Throws Error when the engine gives up.
    virtual void step(Real dt) = 0;

    // One state for each body of the scene, in its order and in its body frames; static bodies too. May throw Error.
    virtual void states(std::vector<BodyState>& out) const = 0;

    virtual int contacts() const = 0;  // points in the last step (of the last substep where there are several)

    virtual std::vector<double> phases() const { return {}; }  // [s] so far in each stage of its step, where it measures them
};

}  // namespace cairn::cli
