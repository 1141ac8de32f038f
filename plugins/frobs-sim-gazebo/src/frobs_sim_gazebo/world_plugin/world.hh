// A simulation's access to its Gazebo world: bodies, joints, contacts, forces.
#pragma once

#include <gazebo/physics/physics.hh>
#include <gazebo/physics/ode/ODELink.hh>
#include <gazebo/physics/ode/ode_inc.h>

#include <set>
#include <string>
#include <vector>

#include "contacts.hh"
#include "joint.hh"
#include "wire.hh"

namespace frobs
{
/// Executes physics steps, and reads and writes the state between steps.
class World
{
  public: explicit World(const gazebo::physics::WorldPtr &_world) : world(_world) {}

  /// Set the physics timestep and gravity.
  public: void Setup(Reader &_message);

  /// Set the joints, bodies and contacts of the messages, in order.
  public: void Layout(Reader &_message);

  /// Whether the layout contains a part of a model, which then cannot be deleted.
  public: bool Holds(const std::string &_model) const { return this->models.count(_model) > 0; }

  /// Disable collisions between links of a model that currently overlap; respond with the pairs.
  public: std::string Part(Reader &_message);

  public: void Gains(Reader &_message);

  /// Teleport bodies, and set the resulting positions of their joints.
  public: void Write(Reader &_message);

  /// Teleport a static model.
  public: void Place(Reader &_message);

  public: std::string Rays(Reader &_message);

  public: void Push(Reader &_message);

  public: void Gravity(Reader &_message);

  public: void Mass(Reader &_message);

  public: void Friction(Reader &_message);

  /// Clear contacts, forces and efforts, and the divergence flag.
  public: void Clear();

  /// Begin a request of steps: one row of commands, or one row per step.
  public: void Begin(uint32_t _steps, std::vector<double> _commands, uint32_t _rows);

  /// Set the forces of the next physics step.
  public: void BeforeStep();

  /// Evaluate the last step; return whether another one follows.
  public: bool AfterStep();

  public: std::string State();

  private: gazebo::physics::ModelPtr Model(const std::string &_name) const;
  private: gazebo::physics::ModelPtr Keep(const std::string &_name);
  private: bool Sound() const;

  private: struct Pushed
  {
    dBodyID body;
    double numbers[9];  // point in the body's frame, force and torque in the world
  };

  private: gazebo::physics::WorldPtr world;
  private: std::set<std::string> models;
  private: std::vector<Joint> joints;
  private: std::vector<gazebo::physics::ODELinkPtr> links;
  private: std::vector<dBodyID> bodies;
  private: std::vector<Pushed> pushes;
  private: Contacts contacts;
  private: std::vector<double> commands;
  private: uint32_t rows = 0, row = 0, left = 0;
  private: double timestep = 0;
  private: bool broken = false;
};
}
