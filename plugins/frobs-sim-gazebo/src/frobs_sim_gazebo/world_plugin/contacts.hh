// The contacts that a scene declares, over all physics steps of a request.
#pragma once

#include <gazebo/physics/physics.hh>

#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "wire.hh"

namespace frobs
{
class Contacts
{
  /// Set the shapes, and the pairs whose contacts are reported.
  ///
  /// \return Names of the models that contain the shapes.
  public: std::set<std::string> Load(Reader &_message, const gazebo::physics::WorldPtr &_world);

  /// Record the contacts of the last step.
  public: void Collect(const gazebo::physics::WorldPtr &_world);

  public: void Clear();

  /// Append for each contact whether it occurred (0 or 1), the largest normal force, and the mean total force on the
  /// first side in the world [N].
  public: void Write(Writer &_state) const;

  /// A shape by its index in the layout.
  public: gazebo::physics::CollisionPtr Shape(uint32_t _index) const { return this->shapes.at(_index); }

  private: struct Declared
  {
    std::vector<char> first, second, ignored;
    double seen = 0, force = 0;
    ignition::math::Vector3d total;

    bool Means(uint32_t _a, uint32_t _b) const
    {
      return this->first[_a] && this->second[_b] && !this->ignored[_b];
    }
  };

  private: std::vector<char> Mask(const std::vector<uint32_t> &_indices) const;

  private: std::vector<gazebo::physics::CollisionPtr> shapes;
  private: std::unordered_map<const gazebo::physics::Collision *, uint32_t> indices;
  private: std::vector<Declared> declared;
  private: int steps = 0;
};
}
