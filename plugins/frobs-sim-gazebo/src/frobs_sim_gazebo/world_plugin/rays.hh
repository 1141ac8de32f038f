// Rays: distances to colliding shapes.
#pragma once

#include <gazebo/physics/physics.hh>

#include <string>
#include <vector>

namespace frobs
{
/// Return the distance along each ray [m], or the range if it hits nothing.
///
/// \param _blindTo Name of a model that rays ignore, or empty.
std::vector<double> Cast(const gazebo::physics::WorldPtr &_world, const std::vector<double> &_origins,
    const std::vector<double> &_directions, double _range, const std::string &_blindTo);
}
