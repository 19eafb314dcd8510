"""The commented scene that "flatpush init" writes."""


def scene_template() -> str:
    """The text of a scene file that loads as it is; comments name the keys that it does not use."""
    return _TEMPLATE


_TEMPLATE = """\
# A scene for flatpush: which object, pushed by what, from where to where.
# flatpush plan FILE --figure plan.svg     plans it
flatpush: scene/1
units: {length: mm, angle: deg}   # m, cm or mm; rad or deg. Without this line: m and rad.

object:
  name: triangle
  # The outline seen from above: a list of [x, y] corners in either sense, in any coordinates you like.
  # Or {circle: 40, centre: [0, 0]}, or a drawing: {file: part.svg} or {file: part.dxf}; of a drawing, if you like,
  # one layer, and a frame: {file: part.dxf, layer: CUT, origin: centroid, turn: 90}; or {file: mask.png, pixel: 0.4}.
  outline: [[19.667, -9.5], [19.667, 19.0], [-39.333, -9.5]]
  # Where it presses on the table: uniform (everywhere), outline (along its edge), {disc: 20}, {ring: 20}
  # (both take centre: [x, y]), or feet, {points: [[x, y, weight], ...]}. If it stands on something of
  # another shape: {polygon: [[x, y], ...]} (inside) or {outline: [[x, y], ...]} (along the edge).
  support: uniform
  friction: 0.3                   # Coulomb coefficient between fingertip and object
  # A limit surface that you measured: about the centre of friction, always in SI; it overrides support:
  # surface: {ellipsoid: [[1, 0, 0], [0, 1, 0], [0, 0, 2500]]}
  # surface: {quartic: [15 coefficients]}
  # surface: {file: surface.json}
  # How well pressure and friction are known; two-finger pushes then hold for all of it:
  # uncertainty: {loads: 0.2, friction: [0.24, 0.4], offset: 0.5, start: {position: 2, angle: 2}}

pusher:
  fingers: 2                      # 1 or 2
  spacing: 18                     # of the centres of two fingertips
  tip_radius: 2.5
  # The values below are the defaults.
  speed: 20                       # of the fastest fingertip, per second
  acceleration: 100
  approach: 2                     # distance from the object at which it lands and leaves
  turns: true                     # false: one finger that keeps its orientation and rolls along the object
  transit: lift                   # between pushes: lift, or planar (stays on the table)
  lift: 30                        # height of a lifted transit
  turn_rate: 90                   # of the hand, per second
  travel_speed: 100               # of the fastest fingertip while it is lifted
  travel_acceleration: 500

# Where to push: auto, or a list of places.
pushes:
  - {name: long edge, at: [0, -9.5]}              # the outline point nearest to [x, y]
  - {name: short edge, edge: 0, along: 0.5}       # edge 0 runs from the first corner to the second
  - {name: hypotenuse, at: [-3.72, 7.70], fingers: 2, spacing: 18}

start: [30, 50, 45]               # x, y, angle of the object's drawing on the table
goal: [0, 0, 0]                   # [0, 0, free]: any angle

# Where object and pusher must stay:
# workspace:
#   bounds: [-225, -127, 225, 127]              # xmin, ymin, xmax, ymax
#   obstacles: [[[80, 60], [120, 60], [120, 90]], {circle: 20, centre: [-60, 80]}]

# Recordings of pushes for flatpush identify: their own names of columns, and the units of those that tell none.
# logs: {columns: {x: obj_x, theta: yaw}, length: mm, angle: deg}

# How to plan; every key may be left out, and the values here are the defaults.
planning:
  model: exact                    # friction with the table: exact, ellipsoid, local or quartic
  two_finger: cone                # cone: all that both fingers can do; middle: as one finger between them
  proof: set                      # of an object with an uncertainty: on every table of the set, or on the nominal one
  slides: auto                    # pushes that slide: auto (where no push can steer), join (where cheaper) or never
  cost: flat                      # what is kept short: flat (path of the car), pusher (its path) or time
  switch_cost: 30                 # of each change of contact, in the unit of the cost; 0 for pusher and time
  margin:
    friction: 0.2                 # the part by which the friction cone is narrowed
    clearance: 0                  # distance from obstacles and bounds
  goal_tolerance: [0.5, 0.5, 0.5] # plans end where it is cheapest within what is wider than this
  robust: false                   # true: keep the cost low after small errors of the switch poses
  seed: 0                         # of the random search
  iterations: 10000               # the search stops here
  time_limit: 5                   # seconds; the search may stop earlier
"""
