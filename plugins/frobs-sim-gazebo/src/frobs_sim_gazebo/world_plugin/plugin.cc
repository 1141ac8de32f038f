// A Gazebo 11 world that one client controls in lock-step.
//
// Requests are served inside Gazebo's own loop, at the beginning of an update. The loop waits there until a request
// asks for a step, so the time is paused, nothing is computed, and all data is read and written between two steps.

#include <gazebo/common/Plugin.hh>
#include <gazebo/common/Events.hh>
#include <gazebo/gazebo_config.h>

#include <chrono>
#include <cstdlib>
#include <memory>
#include <thread>

#include "channel.hh"
#include "world.hh"

namespace frobs
{
class WorldPlugin : public gazebo::WorldPlugin
{
  public: void Load(gazebo::physics::WorldPtr _world, sdf::ElementPtr) override
  {
    const char *socket = std::getenv("FROBS_GAZEBO_FD");
    if (!socket)
    {
      gzerr << "frobs_world: FROBS_GAZEBO_FD is not a socket; this world is started by frobs-sim-gazebo.\n";
      return;
    }
    this->gazebo = _world;
    this->world = std::make_unique<World>(_world);
    this->channel = std::make_unique<Channel>(std::atoi(socket));
    this->begin = gazebo::event::Events::ConnectWorldUpdateBegin([this](const auto &) { this->OnBegin(); });
    this->end = gazebo::event::Events::ConnectWorldUpdateEnd([this] { this->OnEnd(); });
  }

  private: void OnBegin()
  {
    if (this->stepping)
    {
      this->world->BeforeStep();
      return;
    }
    if (!this->awaited.empty() && !this->HaveCome())
      return;
    std::string body;
    while (true)
    {
      const Op op = this->channel->Receive(body);
      try
      {
        if (this->Serve(op, Reader(body)))
          return;
      }
      catch (const std::exception &error)
      {
        this->channel->Refuse(error.what());
      }
    }
  }

  private: void OnEnd()
  {
    if (this->stepping && !this->world->AfterStep())
    {
      this->stepping = false;
      this->channel->Answer(this->world->State());
    }
  }

  /// Check whether all spawned models exist; Gazebo adds new ones a few times per second.
  private: bool HaveCome()
  {
    for (const auto &name : this->awaited)
    {
      if (this->gazebo->ModelByName(name))
        continue;
      if (std::chrono::steady_clock::now() > this->deadline)
      {
        this->awaited.clear();
        this->gazebo->SetPhysicsEnabled(true);
        this->channel->Refuse("Gazebo did not add model '" + name + "'; see its log");
        return true;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
      return false;
    }
    this->awaited.clear();
    this->gazebo->SetPhysicsEnabled(true);
    this->channel->Answer("");
    return true;
  }

  /// Serve a request; return whether it requires Gazebo's loop to continue.
  private: bool Serve(Op _op, Reader _message)
  {
    std::string answer;
    switch (_op)
    {
      case Op::HELLO: answer = GAZEBO_VERSION_FULL; break;
      case Op::SETUP: this->world->Setup(_message); break;
      case Op::SPAWN: return this->Spawn(_message);
      case Op::REMOVE: this->Remove(_message.Text()); break;
      case Op::MODELS: answer = this->Models(); break;
      case Op::LAYOUT: this->world->Layout(_message); break;
      case Op::PART: answer = this->world->Part(_message); break;
      case Op::STEP: return this->Step(_message);
      case Op::GAINS: this->world->Gains(_message); break;
      case Op::WRITE: this->world->Write(_message); answer = this->world->State(); break;
      case Op::PLACE: this->world->Place(_message); break;
      case Op::RAYS: answer = this->world->Rays(_message); break;
      case Op::PUSH: this->world->Push(_message); break;
      case Op::GRAVITY: this->world->Gravity(_message); break;
      case Op::MASS: this->world->Mass(_message); break;
      case Op::FRICTION: this->world->Friction(_message); break;
      case Op::STATE: answer = this->world->State(); break;
      case Op::CLEAR: this->world->Clear(); break;
      default: throw std::runtime_error("there is no operation " + std::to_string(static_cast<int>(_op)));
    }
    this->channel->Answer(answer);
    return false;
  }

  private: bool Spawn(Reader &_message)
  {
    std::vector<std::string> names, texts;
    for (uint32_t i = _message.Count(); i > 0; --i)
    {
      names.push_back(_message.Text());
      texts.push_back(_message.Text());
      if (this->gazebo->ModelByName(names.back()))
        throw std::runtime_error("a model '" + names.back() + "' already exists");
    }
    for (const auto &text : texts)
      this->gazebo->InsertModelString(text);
    this->awaited = names;
    this->deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    this->gazebo->SetPhysicsEnabled(false);
    return true;
  }

  private: void Remove(const std::string &_name)
  {
    auto model = this->gazebo->ModelByName(_name);
    if (!model)
      throw std::runtime_error("there is no model '" + _name + "'");
    if (this->world->Holds(_name))
      throw std::runtime_error("model '" + _name + "' is part of the simulation and cannot be deleted");
    this->gazebo->RemoveModel(model);
  }

  private: std::string Models() const
  {
    std::string names;
    for (const auto &model : this->gazebo->Models())
      names += model->GetName() + "\n";
    return names;
  }

  private: bool Step(Reader &_message)
  {
    const uint32_t steps = _message.Count(), rows = _message.Count(), joints = _message.Count();
    if (steps == 0 || rows == 0)
      throw std::runtime_error("the request has no steps or no command");
    this->world->Begin(steps, _message.Numbers(rows * joints), rows);
    this->world->BeforeStep();
    this->stepping = true;
    return true;
  }

  private: gazebo::physics::WorldPtr gazebo;
  private: std::unique_ptr<World> world;
  private: std::unique_ptr<Channel> channel;
  private: gazebo::event::ConnectionPtr begin, end;
  private: bool stepping = false;
  private: std::vector<std::string> awaited;
  private: std::chrono::steady_clock::time_point deadline;
};

GZ_REGISTER_WORLD_PLUGIN(WorldPlugin)
}
