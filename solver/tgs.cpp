#include "solver/tgs.hpp"

namespace cairn {

SiSettings tgs_settings(const SiSettings& settings) {
    SiSettings out = settings;
    out.stabilisation = SiStabilisation::kSoft;
    out.iterations = 1;
    return out;
}

SiReport solve_island_tgs(SolverBodies& bodies, ContactPool& contacts, JointPool& joints, const SiIsland& island, Real dt,
                          const SiSettings& settings, IslandProbe* probe) {
    return solve_island_si(bodies, contacts, joints, island, dt, tgs_settings(settings), nullptr, probe);
}

}  // namespace cairn
