"""Moving switch poses downhill: a plan as one chain of arcs with amounts y ≥ 0 [m of the flat paths].

In the switch poses the cost has kinks and jumps. In the arcs it is smooth, for linear costs even linear: what bends is
the end of the chain, which has to stay at the goal. An arc that vanishes is a bound, not a jump.

* A turn about the world point c moves the end P along ±perp(P - c) and turns it; a straight piece moves it along
  itself. These are the columns of the end's Jacobian, and an earlier turn just turns a later column: the second
  derivative ∂²P/∂y_i ∂y_j is κ_i perp(∂P/∂y_j) for i ≤ j, with κ_i the turn per length of arc i.
* Each step solves the optimality conditions of the arcs that are not at zero, with the Hessian of the Lagrangian and a
  damping that grows until the cost falls; it stops at the first arc that vanishes, and is led back to the goal.
* The multipliers λ of the end are the constant covector of the maximum principle. An arc of a motion that is not
  part of the chain pays at a place if its price is less than λ · (its column there): such arcs are taken in, at zero.
* At the end every leg gets its cheapest word; while that pays, the descent is repeated.

Legs must be at least `least` long, which is one more linear condition where it binds.
"""
