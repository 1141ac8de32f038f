// Rays: how far it is to what collides.
#pragma once

#include <gazebo/physics/physics.hh>

#include <string>
#include <vector>

namespace frobs
{
/// Return the distance along each ray [m], and the range where nothing is met.
///
/// \param _blindTo Name of a model that is not seen, or nothing.
std::vector<double> Cast(const gazebo::physics::WorldPtr &_world, const std::vector<double> &_origins,
    const std::vector<double> &_directions, double _range, const std::string &_blindTo);
}
