"""The forms of recordings, in words: for the help of commands, which need no reader."""

CSV = "a .csv file with a .yaml of the same name beside it"
EV5 = "a folder with an .EV5 header"
UDS = "a folder with UDS files"
MME = "a folder with an .mme header"
BAG = "a bag (a rosbag2 folder or an .mcap file)"
FORMS = (CSV, EV5, UDS, MME, BAG)
