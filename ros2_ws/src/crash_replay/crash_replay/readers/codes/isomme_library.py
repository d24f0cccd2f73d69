"""ISO-MME's channel codes (ISO/TS 13499, RED B 1.6.2): what main locations, positions, fine locations and belts are.

As public tools list them (pyisomme, channel_codes.xml, MIT licence). Codes of results (HICR, NIJC, ...) are not of
sensors and not here; of OWN the standard knows nothing, laboratories and NHTSA's exports use them.
"""

HUMAN = """
ACHI achilles_tendon; ACRO acromion; FIBU fibula; LLEG lower_leg; RADI radius; SCAP scapula; SKUL skull;
ULEG upper_leg; ULNA ulna; BRAI brain; HUMS humerus
"""

DUMMY = """
HEAD head; CESP cervical_spine; NECK neck; SHLD shoulder; CLAV clavicle; UPAR upper_arm; ELBJ elbow_joint;
FOAR forearm; WRIS wrist; SHRI shoulder_rib; TRRI thorax_rib; RIBS rib; CHRI chest_rib; TRSP thorax_rib_to_spine;
SPIN spine; THSP thoracic_spine; BAPL backplate; MUSU muscle_substitute; CHST chest; STRN sternum; CHBA chest_band;
ABRI abdominal_rib; ABSP abdominal_spine; ABDO abdomen; LUSP lumbar_spine; PELV pelvis; ACTB acetabulum;
HPNT h_point; ILUM ilium; ILAC iliac; PUBC pubic; CROB crotch_belt; SACR sacrum; FEAC femur_to_acetabulum;
FEMR femur; KNEE knee; CLEV clevis; KNSL knee_slider; TIRA tibia_ratio; TIBI tibia; ANKL ankle; FOOT foot;
HEEL heel; TOES toe; DAMP damper; OCCU occupant; SUMA submarining
"""

VEHICLE = """
ABSE airbag_sensor; AIRB airbag; APIL a_pillar; AXLE axle; BAFI belt_anchor_fitting; BATT battery; BCKL buckle;
BLOK belt_lock; BLOP belt_loop; BPIL b_pillar; BRBO brake_booster; BUMP bumper; BUSY bumper_system;
CASH cardan_shaft; CCBE cross_car_beam; CEUN central_unit; CHAR battery_charger; CPIL c_pillar;
CRAN child_restraint_anchor; CRME crossmember; CRSB child_restraint_seatbelt; CTAN child_tether_anchorages;
CTUN control_unit; DASB dashboard; DASH dash_panel; DIFF differential; DOOR door; DOPA door_panel; DPIL d_pillar;
ENGN engine; FEND fender; FORA floor_over_rear_axle; FOWE footwell; FRAM frame; FREN frontend;
FUL2 second_fuel_tank; FULT fuel_tank; GEAR gearbox; GENR generator; HEPL heel_plate; HERE head_restraint;
HOOD hood; INSW inertia_switch; KNBO knee_bolster; LAMP lamp; LOCK lock; LOLI load_limiter; LOSY lock_system;
MSME main_side_member; OILS oil_sump; PEAC pedal_accelerator; PEBR pedal_brake; PECL pedal_clutch; POCA power_cable;
POEL power_electronics; PRET pretensioner; RACM radiator_cross_member; RETR retractor; ROFR roof_frame; ROOF roof;
ROPS rollover_protection_system; RORA roof_rack; RVMB rear_view_mirror_base; RVMR rear_view_mirror;
SBAD seat_back_adjuster; SBHA seat_belt_height_adjuster; SEAD seat_adjuster; SEAT seat; SEBA seat_back;
SEBE seat_belt; SECM seat_cross_member; SEFR seat_frame; SEPN seat_pan; SERM seat_rail_mount; SETR seat_track;
SILB sill_beam; SIME side_member; SLMB slam_beam; STAR starter; STBR strut_brace; STCM steering_column_mount;
STCO steering_column; STCS steering_column_suspension; STEP step; STWH steering_wheel_hub; STWL steering_wheel;
SUBF subframe; SUDO suspension_dome; SUHO suspension_housing; SUSM suspension_mount; SUUN suspension_unit;
TAIG tailgate; TAIL tail; TBAT traction_battery; TOPT top_tether; TRAN transmission; TRCM transmission_cross_member;
TUNN tunnel; VEHC vehicle; WARC wheel_arch; WHBC wheel_brake_caliper; WHEL wheel; WIND window
"""

OTHER = """
ACTU actuator; DEFO deformable_element; FBAR fixed_barrier; GRND ground_sand_bed_embankment; IMPA impactor;
LOMA load_cell_matrix; LUGG luggage; MBAR mobile_barrier; PLAF platform; POLE pole; RAMP ramp; SENS sensor;
SFAD static_force_application_device; SLED sled; TDCG traction_device_center_of_gravity;
TDLB traction_device_lap_belt; TDSB traction_device_shoulder_belt; TEST test_signal
"""

OWN = """
FLOR floor; FOOR floor; FLPA floorpan; SILL sill; STCL steering_column; POWT powertrain; WALL barrier_wall;
BRAK brake; INST instrument_panel; TRUN trunk; BPLL b_pillar
"""


def _table(*texts: str) -> dict[str, str]:
    entries = (entry.split() for text in texts for entry in text.replace("\n", " ").split(";"))
    return {code: name for code, name in entries}


MAIN_LOCATIONS = _table(HUMAN, DUMMY, VEHICLE, OTHER, OWN)
TEST_OBJECTS = {
    "B": "barrier", "C": "component", "D": "dummy", "H": "impactor", "M": "mdb", "P": "pendulum", "S": "sled",
    "T": "rig",
}  # fmt: skip
"""Vehicles are numbered, 1 to 9."""
POSITIONS = {
    "1": "front_left", "2": "front_middle", "3": "front_right", "4": "second_left", "5": "second_middle",
    "6": "second_right", "7": "third_left", "8": "third_middle", "9": "third_right",
} | {letter: f"seat_{letter.lower()}" for letter in "ABCDEFGHIJKLMNOPQRSTUVWXYZ"}  # fmt: skip
FINE_LOCATIONS = {
    "00": "", "CG": "", "LE": "left", "RI": "right", "UP": "upper", "LO": "lower", "MI": "middle", "FR": "front",
    "RE": "rear", "BO": "bottom", "TP": "top", "IN": "inner", "OU": "outer", "LL": "left_lower", "LU": "left_upper",
    "RL": "right_lower", "RU": "right_upper", "LM": "left_middle", "RM": "right_middle", "AV": "average", "SU": "sum",
    "RD": "redundant", "L1": "left_redundant", "R1": "right_redundant", "U1": "upper_redundant",
    "L2": "lower_redundant", "M1": "middle_redundant",
}  # fmt: skip
"""Fine locations 1 and 2; numbers count."""
BELT_PLACES = {
    "B1": "retractor", "B2": "below_loop", "B3": "upper_diagonal", "B4": "lower_diagonal", "B5": "lap_inside",
    "B6": "lap_outside",
}  # fmt: skip
"""Fine location 3, which else is the dummy."""
FILTER_CLASSES = {"A": 1000, "B": 600, "C": 180, "D": 60, "E": 1000, "F": 600, "G": 180, "H": 60, "L": 20}
"""Those that stand for a CFC; the others say unfiltered, prefiltered or special."""
OTHER_SIGN = {"1": "x", "2": "y", "3": "z"}
"""Directions whose sign is not that of SAE J211."""
