#include "rays.hh"

#include <gazebo/physics/ode/ODECollision.hh>
#include <gazebo/physics/ode/ODEPhysics.hh>
#include <gazebo/physics/ode/ode_inc.h>

#include <stdexcept>

namespace frobs
{
namespace
{
struct Search
{
  dGeomID ray;
  gazebo::physics::Model *blindTo;
  double nearest;
};

void Meet(void *_data, dGeomID _first, dGeomID _second)
{
  auto *search = static_cast<Search *>(_data);
  if (dGeomIsSpace(_first) || dGeomIsSpace(_second))
  {
    dSpaceCollide2(_first, _second, _data, &Meet);
    return;
  }
  const dGeomID other = _first == search->ray ? _second : _first;
  auto *collision = static_cast<gazebo::physics::ODECollision *>(dGeomGetData(other));
  if (!collision || (search->blindTo && collision->GetModel().get() == search->blindTo))
    return;
  dContactGeom hit;
  if (dCollide(search->ray, other, 1, &hit, sizeof(hit)) > 0 && hit.depth < search->nearest)
    search->nearest = hit.depth;
}
}

std::vector<double> Cast(const gazebo::physics::WorldPtr &_world, const std::vector<double> &_origins,
    const std::vector<double> &_directions, double _range, const std::string &_blindTo)
{
  auto physics = boost::dynamic_pointer_cast<gazebo::physics::ODEPhysics>(_world->Physics());
  if (!physics)
    throw std::runtime_error("the world's physics is not ODE");
  auto blindTo = _blindTo.empty() ? nullptr : _world->ModelByName(_blindTo);
  const dGeomID ray = dCreateRay(nullptr, _range);
  dGeomRaySetClosestHit(ray, 1);
  std::vector<double> distances;
  distances.reserve(_origins.size() / 3);
  for (size_t i = 0; i + 2 < _origins.size(); i += 3)
  {
    Search search{ray, blindTo.get(), _range};
    dGeomRaySet(ray, _origins[i], _origins[i + 1], _origins[i + 2],
        _directions[i], _directions[i + 1], _directions[i + 2]);
    dSpaceCollide2(ray, reinterpret_cast<dGeomID>(physics->GetSpaceId()), &search, &Meet);
    distances.push_back(search.nearest);
  }
  dGeomDestroy(ray);
  return distances;
}
}
