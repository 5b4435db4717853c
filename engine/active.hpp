// What a step has to pass over: the bodies, contacts and joints that something moves. Everything else sleeps or stands, and costs nothing.
#pragma once

#include "engine/active_list.hpp"
#include "engine/links.hpp"

#include <cstdint>
#include <vector>

namespace cairn {

struct WorldData;

struct ActiveSets {
    ActiveList bodies;     // dynamic, awake
    ActiveList kinematic;  // kinematic, enabled
    ActiveList contacts;   // slots of contacts that a moving body takes part in, or that have not been asked of the narrow phase yet
    ActiveList joints;     // with a body that is awake
    Links contact_links;   // slots of the contact store by body
    Links joint_links;     // joints by body
    std::vector<std::uint32_t> moved;     // bodies put somewhere else by a caller
    std::vector<std::uint32_t> roomless;  // scratch: bodies that have left their fat boxes
    std::uint32_t sleeping = 0;
    std::uint32_t quiet_manifolds = 0;  // of contacts that are not in the list
    std::uint32_t quiet_points = 0;
    bool has_ended = false;    // a contact or joint of the lists has gone
    bool has_stopped = false;  // something of the lists has fallen asleep, stopped or gone
};

// Begins to pass over a body that moves or may, with its contacts and joints.
void activate(WorldData& world, std::uint32_t body);
// The same for a contact that has begun and a joint that has been added; ended: for one that has been removed.
void activate_contact(WorldData& world, std::uint32_t slot);
void activate_joint(WorldData& world, std::uint32_t joint);
void end_contact(WorldData& world, std::uint32_t slot);
void end_joint(WorldData& world, std::uint32_t joint);
// Brings the lists up to date with all of this.
void refresh_active(WorldData& world);

// Notes that a body has been put somewhere else: the broad phase has to be told, whether or not it moves by itself.
void mark_moved(WorldData& world, std::uint32_t body);

}  // namespace cairn
