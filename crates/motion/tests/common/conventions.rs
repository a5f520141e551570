//! How suites, engines and trackers call the joints.

/// How a convention calls the joints; `{}` takes the place of the side, `-` stands for no joint.
pub struct Convention {
    pub what: &'static str,
    /// Words of the left and the right side.
    pub sides: [&'static str; 2],
    /// Pelvis, then the spine, neck and head.
    pub trunk: &'static str,
    /// Hip, knee, ankle and ball.
    pub leg: &'static str,
    /// Collar, shoulder, elbow, wrist and, in some, hand.
    pub arm: &'static str,
    /// What stands in between and beside: `name<parent` hangs a joint on another, `name>child` puts one
    /// at the place of another between it and its parent, `name=child` one half-way to the child.
    pub others: &'static str,
}

const fn of(
    what: &'static str,
    sides: [&'static str; 2],
    [trunk, leg, arm, others]: [&'static str; 4],
) -> Convention {
    Convention {
        what,
        sides,
        trunk,
        leg,
        arm,
        others,
    }
}

const LEFT_RIGHT: [&str; 2] = ["Left", "Right"];
const L_R: [&str; 2] = ["L", "R"];
const SMALL_L_R: [&str; 2] = ["l", "r"];

#[rustfmt::skip]
pub const CONVENTIONS: &[Convention] = &[
    of("Mixamo", LEFT_RIGHT, [
        "mixamorig:Hips mixamorig:Spine mixamorig:Spine1 mixamorig:Spine2 mixamorig:Neck mixamorig:Head",
        "mixamorig:{}UpLeg mixamorig:{}Leg mixamorig:{}Foot mixamorig:{}ToeBase",
        "mixamorig:{}Shoulder mixamorig:{}Arm mixamorig:{}ForeArm mixamorig:{}Hand",
        "mixamorig:{}HandIndex1<mixamorig:{}Hand mixamorig:{}HandThumb1<mixamorig:{}Hand \
         mixamorig:{}Toe_End<mixamorig:{}ToeBase mixamorig:HeadTop_End<mixamorig:Head"]),
    of("Mixamo without colons, numbered by an exporter", LEFT_RIGHT, [
        "mixamorigHips_01 mixamorigSpine_02 mixamorigSpine1_03 mixamorigSpine2_04 mixamorigNeck_05 mixamorigHead_06",
        "mixamorig{}UpLeg_055 mixamorig{}Leg_056 mixamorig{}Foot_057 mixamorig{}ToeBase_058",
        "mixamorig{}Shoulder_07 mixamorig{}Arm_08 mixamorig{}ForeArm_09 mixamorig{}Hand_010",
        "mixamorig{}HandIndex1_011<mixamorig{}Hand_010"]),
    of("CMU, cgspeed", LEFT_RIGHT, [
        "Hips LowerBack Spine Spine1 Neck Head",
        "{}UpLeg {}Leg {}Foot {}ToeBase",
        "{}Shoulder {}Arm {}ForeArm {}Hand {}FingerBase",
        "{}HipJoint>{}UpLeg Neck1=Head {}HandIndex1<{}FingerBase {}Thumb<{}Hand"]),
    of("CMU, Acclaim", SMALL_L_R, [
        "root lowerback upperback thorax lowerneck head",
        "{}femur {}tibia {}foot {}toes",
        "{}clavicle {}humerus {}radius {}wrist {}hand",
        "{}hipjoint>{}femur upperneck=head {}fingers<{}hand {}thumb<{}hand"]),
    of("Rigify, DEF", L_R, [
        "DEF-spine DEF-spine.001 DEF-spine.002 DEF-spine.003 DEF-spine.004 DEF-spine.006",
        "DEF-thigh.{} DEF-shin.{} DEF-foot.{} DEF-toe.{}",
        "DEF-shoulder.{} DEF-upper_arm.{} DEF-forearm.{} DEF-hand.{}",
        "DEF-pelvis.{}<DEF-spine DEF-thigh.{}.001=DEF-shin.{} DEF-shin.{}.001=DEF-foot.{} \
         DEF-upper_arm.{}.001=DEF-forearm.{} DEF-forearm.{}.001=DEF-hand.{} DEF-spine.005=DEF-spine.006 \
         DEF-breast.{}<DEF-spine.003 DEF-thumb.01.{}<DEF-hand.{} DEF-f_index.01.{}<DEF-hand.{}"]),
    of("Rigify, metarig", L_R, [
        "spine spine.001 spine.002 spine.003 spine.004 spine.006",
        "thigh.{} shin.{} foot.{} toe.{}",
        "shoulder.{} upper_arm.{} forearm.{} hand.{}",
        "pelvis.{}<spine spine.005=spine.006 heel.02.{}<foot.{} palm.01.{}<hand.{}"]),
    of("Blender duplicate", L_R, [
        "hips.001 spine.001 chest.001 neck.001 head.001",
        "thigh.{}.001 shin.{}.001 foot.{}.001 toe.{}.001",
        "shoulder.{}.001 upper_arm.{}.001 forearm.{}.001 hand.{}.001", ""]),
    of("Auto-Rig Pro", SMALL_L_R, [
        "root.x spine_01.x spine_02.x spine_03.x neck.x head.x",
        "thigh_stretch.{} leg_stretch.{} foot.{} toes_01.{}",
        "shoulder.{} arm_stretch.{} forearm_stretch.{} hand.{}",
        "thigh_twist.{}<root.x leg_twist.{}<leg_stretch.{} arm_twist.{}<shoulder.{} c_index1.{}<hand.{}"]),
    of("Unreal mannequin", SMALL_L_R, [
        "pelvis spine_01 spine_02 spine_03 neck_01 head",
        "thigh_{} calf_{} foot_{} ball_{}",
        "clavicle_{} upperarm_{} lowerarm_{} hand_{}",
        "root>pelvis thigh_twist_01_{}<thigh_{} calf_twist_01_{}<calf_{} upperarm_twist_01_{}<upperarm_{} \
         lowerarm_twist_01_{}<lowerarm_{} index_01_{}<hand_{} ik_foot_{}<root ik_hand_{}<root"]),
    of("Unity humanoid", LEFT_RIGHT, [
        "Hips Spine Chest UpperChest Neck Head",
        "{}UpperLeg {}LowerLeg {}Foot {}Toes",
        "{}Shoulder {}UpperArm {}LowerArm {}Hand",
        "{}IndexProximal<{}Hand {}Eye<Head Jaw<Head"]),
    of("MotionBuilder", LEFT_RIGHT, [
        "Character1_Hips Character1_Spine Character1_Spine1 Character1_Neck Character1_Head",
        "Character1_{}UpLeg Character1_{}Leg Character1_{}Foot Character1_{}ToeBase",
        "Character1_{}Shoulder Character1_{}Arm Character1_{}ForeArm Character1_{}Hand",
        "Character1_Reference>Character1_Hips"]),
    of("HumanIK controls", LEFT_RIGHT, [
        "Actor_Ctrl_Hips Actor_Ctrl_Spine Actor_Ctrl_Chest Actor_Ctrl_Neck Actor_Ctrl_Head",
        "Actor_Ctrl_{}UpLeg Actor_Ctrl_{}Leg Actor_Ctrl_{}Foot Actor_Ctrl_{}ToeBase",
        "Actor_Ctrl_{}Shoulder Actor_Ctrl_{}Arm Actor_Ctrl_{}ForeArm Actor_Ctrl_{}Hand", ""]),
    of("3ds Max Biped", L_R, [
        "Bip01_Pelvis Bip01_Spine Bip01_Spine1 Bip01_Neck Bip01_Head",
        "Bip01_{}_Thigh Bip01_{}_Calf Bip01_{}_Foot Bip01_{}_Toe0",
        "Bip01_{}_Clavicle Bip01_{}_UpperArm Bip01_{}_Forearm Bip01_{}_Hand",
        "Bip01>Bip01_Pelvis Bip01_{}_Toe0Nub<Bip01_{}_Toe0 Bip01_HeadNub<Bip01_Head \
         Bip01_{}_Finger0<Bip01_{}_Hand Bip01_Footsteps<Bip01 Bip01_{}_ForeTwist<Bip01_{}_Forearm"]),
    of("3ds Max CAT", L_R, [
        "RigPelvis RigSpine1 RigRibcage RigNeck RigHead",
        "Rig{}Leg1 Rig{}Leg2 Rig{}LegAnkle Rig{}LegToe",
        "Rig{}ArmCollarbone Rig{}Arm1 Rig{}Arm2 Rig{}ArmPalm",
        "Rig{}ArmDigit11<Rig{}ArmPalm"]),
    of("Character Creator", L_R, [
        "CC_Base_Hip CC_Base_Waist CC_Base_Spine01 CC_Base_Spine02 CC_Base_NeckTwist01 CC_Base_Head",
        "CC_Base_{}_Thigh CC_Base_{}_Calf CC_Base_{}_Foot CC_Base_{}_ToeBase",
        "CC_Base_{}_Clavicle CC_Base_{}_Upperarm CC_Base_{}_Forearm CC_Base_{}_Hand",
        "RL_BoneRoot>CC_Base_Hip CC_Base_{}_ThighTwist01<CC_Base_{}_Thigh \
         CC_Base_{}_CalfTwist01<CC_Base_{}_Calf CC_Base_{}_KneeShareBone<CC_Base_{}_Calf \
         CC_Base_{}_ElbowShareBone<CC_Base_{}_Forearm CC_Base_{}_ToeBaseShareBone<CC_Base_{}_Foot \
         CC_Base_{}_BigToe1<CC_Base_{}_ToeBase CC_Base_NeckTwist02=CC_Base_Head"]),
    of("iPi", L_R, [
        "Hip LowerSpine MiddleSpine Chest Neck Head",
        "{}Thigh {}Shin {}Foot {}Toe",
        "{}Clavicle {}Shoulder {}Forearm {}Hand", ""]),
    of("Kinect v1", LEFT_RIGHT, [
        "HipCenter Spine ShoulderCenter Neck Head",
        "Hip{} Knee{} Ankle{} Foot{}",
        "Collar{} Shoulder{} Elbow{} Wrist{} Hand{}", ""]),
    of("Kinect v2", LEFT_RIGHT, [
        "SpineBase SpineMid SpineShoulder Neck Head",
        "Hip{} Knee{} Ankle{} Foot{}",
        "- Shoulder{} Elbow{} Wrist{} Hand{}",
        "HandTip{}<Hand{} Thumb{}<Wrist{}"]),
    of("Kinect Azure", ["LEFT", "RIGHT"], [
        "PELVIS SPINE_NAVEL SPINE_CHEST NECK HEAD",
        "HIP_{} KNEE_{} ANKLE_{} FOOT_{}",
        "CLAVICLE_{} SHOULDER_{} ELBOW_{} WRIST_{} HAND_{}",
        "HANDTIP_{}<HAND_{} THUMB_{}<WRIST_{} NOSE<HEAD EYE_{}<HEAD EAR_{}<HEAD"]),
    of("OptiTrack", L_R, [
        "Skeleton_001:Hip Skeleton_001:Ab Skeleton_001:Chest Skeleton_001:Neck Skeleton_001:Head",
        "Skeleton_001:{}Thigh Skeleton_001:{}Shin Skeleton_001:{}Foot Skeleton_001:{}Toe",
        "Skeleton_001:{}Shoulder Skeleton_001:{}UArm Skeleton_001:{}FArm Skeleton_001:{}Hand",
        "Skeleton_001:{}Thumb1<Skeleton_001:{}Hand"]),
    of("Xsens, BVH", LEFT_RIGHT, [
        "Hips Chest Chest2 Chest3 Chest4 Neck Head",
        "{}Hip {}Knee {}Ankle {}Toe",
        "{}Collar {}Shoulder {}Elbow {}Wrist", ""]),
    of("Xsens, segments", LEFT_RIGHT, [
        "Pelvis L5 L3 T12 T8 Neck Head",
        "{}UpperLeg {}LowerLeg {}Foot {}Toe",
        "{}Shoulder {}UpperArm {}ForeArm {}Hand", ""]),
    of("Rokoko", LEFT_RIGHT, [
        "Hips Spine Spine2 Spine3 Spine4 Neck Head",
        "{}Thigh {}Shin {}Foot {}Toe",
        "{}Shoulder {}Arm {}ForeArm {}Hand",
        "{}Finger1Metacarpal<{}Hand {}ToeTip<{}Toe"]),
    of("Perception Neuron", LEFT_RIGHT, [
        "Robot_Hips Robot_Spine Robot_Spine1 Robot_Spine2 Robot_Neck Robot_Head",
        "Robot_{}UpLeg Robot_{}Leg Robot_{}Foot Robot_{}Toe",
        "Robot_{}Shoulder Robot_{}Arm Robot_{}ForeArm Robot_{}Hand",
        "Robot_{}InHandIndex<Robot_{}Hand Robot_{}HandIndex1<Robot_{}InHandIndex \
         Robot_{}HandThumb1<Robot_{}Hand"]),
    of("Vicon", ["l", "r"], [
        "Solving:Hips Solving:Spine Solving:Spine1 Solving:Neck Solving:Head",
        "Solving:{}UpLeg Solving:{}Leg Solving:{}Foot Solving:{}Toe",
        "Solving:{}Clavicle Solving:{}Humerus Solving:{}Radius Solving:{}Hand", ""]),
    of("MakeHuman default", L_R, [
        "root spine05 spine04 spine03 spine02 spine01 neck01 head",
        "upperleg01.{} lowerleg01.{} foot.{} toe1-1.{}",
        "clavicle.{} upperarm01.{} lowerarm01.{} wrist.{}",
        "pelvis.{}>upperleg01.{} upperleg02.{}=lowerleg01.{} lowerleg02.{}=foot.{} shoulder01.{}>upperarm01.{} \
         upperarm02.{}=lowerarm01.{} lowerarm02.{}=wrist.{} toe2-1.{}<foot.{} metacarpal1.{}<wrist.{} \
         neck02=head breast.{}<spine02"]),
    of("MakeHuman game engine", SMALL_L_R, [
        "pelvis spine_01 spine_02 spine_03 neck_01 head",
        "thigh_{} calf_{} foot_{} ball_{}",
        "clavicle_{} upperarm_{} lowerarm_{} hand_{}",
        "Root>pelvis thumb_01_{}<hand_{}"]),
    of("SMPL", L_R, [
        "m_avg_Pelvis m_avg_Spine1 m_avg_Spine2 m_avg_Spine3 m_avg_Neck m_avg_Head",
        "m_avg_{}_Hip m_avg_{}_Knee m_avg_{}_Ankle m_avg_{}_Foot",
        "m_avg_{}_Collar m_avg_{}_Shoulder m_avg_{}_Elbow m_avg_{}_Wrist m_avg_{}_Hand",
        "m_avg_root>m_avg_Pelvis"]),
    of("SMPL-X", ["left", "right"], [
        "pelvis spine1 spine2 spine3 neck head",
        "{}_hip {}_knee {}_ankle {}_foot",
        "{}_collar {}_shoulder {}_elbow {}_wrist",
        "{}_index1<{}_wrist {}_thumb1<{}_wrist jaw<head {}_eye_smplhf<head"]),
    of("LAFAN1", LEFT_RIGHT, [
        "Hips Spine Spine1 Spine2 Neck Head",
        "{}UpLeg {}Leg {}Foot {}Toe",
        "{}Shoulder {}Arm {}ForeArm {}Hand", ""]),
    of("Bandai-Namco", L_R, [
        "Hips Spine Chest Neck Head",
        "UpperLeg_{} LowerLeg_{} Foot_{} Toes_{}",
        "Shoulder_{} UpperArm_{} LowerArm_{} Hand_{}",
        "joint_Root>Hips"]),
    of("Geno", LEFT_RIGHT, [
        "Hips Spine Spine1 Spine2 Spine3 Neck Head",
        "{}UpLeg {}Leg {}Foot {}ToeBase",
        "{}Shoulder {}Arm {}ForeArm {}Hand",
        "Neck1=Head HeadEnd<Head {}ToeBaseEnd<{}ToeBase {}HandThumb1<{}Hand {}HandEnd<{}Hand"]),
    of("VRoid", L_R, [
        "J_Bip_C_Hips J_Bip_C_Spine J_Bip_C_Chest J_Bip_C_UpperChest J_Bip_C_Neck J_Bip_C_Head",
        "J_Bip_{}_UpperLeg J_Bip_{}_LowerLeg J_Bip_{}_Foot J_Bip_{}_ToeBase",
        "J_Bip_{}_Shoulder J_Bip_{}_UpperArm J_Bip_{}_LowerArm J_Bip_{}_Hand",
        "J_Sec_{}_Bust1<J_Bip_C_UpperChest J_Adj_{}_FaceEye<J_Bip_C_Head J_Bip_{}_Index1<J_Bip_{}_Hand \
         J_Sec_Hair1_01<J_Bip_C_Head"]),
    of("Daz, Genesis 8", SMALL_L_R, [
        "pelvis abdomenLower abdomenUpper chestLower chestUpper neckLower head",
        "{}ThighBend {}Shin {}Foot {}Toe",
        "{}Collar {}ShldrBend {}ForearmBend {}Hand",
        "hip>pelvis {}ThighTwist={}Shin {}ShldrTwist={}ForearmBend {}ForearmTwist={}Hand \
         {}Metatarsals={}Toe neckUpper=head {}Carpal1<{}Hand {}Thumb1<{}Hand {}BigToe<{}Toe {}Eye<head"]),
    of("Daz, Genesis 9", SMALL_L_R, [
        "pelvis spine1 spine2 spine3 spine4 neck1 head",
        "{}_thigh {}_shin {}_foot {}_toes",
        "{}_shoulder {}_upperarm {}_forearm {}_hand",
        "hip>pelvis {}_thightwist1<{}_thigh {}_metatarsals={}_toes neck2=head {}_pectoral<spine4"]),
    of("Poser", SMALL_L_R, [
        "hip abdomen chest neck head",
        "{}Thigh {}Shin {}Foot {}Toe",
        "{}Collar {}Shldr {}ForeArm {}Hand",
        "{}Buttock>{}Thigh"]),
    of("Source engine", L_R, [
        "ValveBiped.Bip01_Pelvis ValveBiped.Bip01_Spine ValveBiped.Bip01_Spine1 ValveBiped.Bip01_Spine2 \
         ValveBiped.Bip01_Spine4 ValveBiped.Bip01_Neck1 ValveBiped.Bip01_Head1",
        "ValveBiped.Bip01_{}_Thigh ValveBiped.Bip01_{}_Calf ValveBiped.Bip01_{}_Foot ValveBiped.Bip01_{}_Toe0",
        "ValveBiped.Bip01_{}_Clavicle ValveBiped.Bip01_{}_UpperArm ValveBiped.Bip01_{}_Forearm ValveBiped.Bip01_{}_Hand",
        "ValveBiped.Bip01_{}_Finger0<ValveBiped.Bip01_{}_Hand ValveBiped.Bip01_{}_Trapezius<ValveBiped.Bip01_Spine4 \
         ValveBiped.Bip01_{}_Ulna<ValveBiped.Bip01_{}_Forearm"]),
    of("Second Life", LEFT_RIGHT, [
        "mPelvis mTorso mChest mNeck mHead",
        "mHip{} mKnee{} mAnkle{} mToe{}",
        "mCollar{} mShoulder{} mElbow{} mWrist{}",
        "mFoot{}=mToe{} mSkull<mHead mEye{}<mHead mHandThumb1{}<mWrist{}"]),
    of("MikuMikuDance", ["左", "右"], [
        "下半身 上半身 上半身2 首 頭",
        "{}足 {}ひざ {}足首 {}つま先",
        "{}肩 {}腕 {}ひじ {}手首",
        "センター>下半身 {}腕捩={}ひじ {}足ＩＫ<センター {}親指１<{}手首 {}目<頭"]),
    of("MikuMikuDance in English", L_R, [
        "lower_body upper_body upper_body2 neck head",
        "leg_{} knee_{} ankle_{} toe_{}",
        "shoulder_{} arm_{} elbow_{} wrist_{}",
        "center>lower_body leg_IK_{}<center"]),
    of("Advanced Skeleton", L_R, [
        "Root_M Spine1_M Spine2_M Chest_M Neck_M Head_M",
        "Hip_{} Knee_{} Ankle_{} Toes_{}",
        "Scapula_{} Shoulder_{} Elbow_{} Wrist_{}",
        "HipPart1_{}<Hip_{} ToesEnd_{}<Toes_{} IndexFinger1_{}<Wrist_{} HeadEnd_M<Head_M"]),
    of("Roblox", LEFT_RIGHT, [
        "LowerTorso UpperTorso - Head",
        "{}UpperLeg {}LowerLeg {}Foot -",
        "- {}UpperArm {}LowerArm {}Hand",
        "HumanoidRootPart>LowerTorso"]),
    of("OpenSim", SMALL_L_R, [
        "pelvis lumbar torso neck head",
        "femur_{} tibia_{} talus_{} toes_{}",
        "- humerus_{} radius_{} hand_{}",
        "ground>pelvis patella_{}<femur_{} calcn_{}=toes_{} ulna_{}>radius_{}"]),
    of("Visual3D", SMALL_L_R, [
        "pelvis abdomen thorax neck head",
        "{}_thigh {}_shank {}_foot {}_toes",
        "- {}_uarm {}_larm {}_hand", ""]),
    of("pose estimation", LEFT_RIGHT, [
        "Hip Spine Thorax Neck Head",
        "{}Hip {}Knee {}Ankle {}Foot",
        "- {}Shoulder {}Elbow {}Wrist", ""]),
    of("shouted, glued", ["L", "R"], [
        "HIPS CHEST CHEST2 NECK HEAD",
        "{}HIP {}KNEE {}ANKLE {}TOE",
        "{}COLLAR {}SHOULDER {}ELBOW {}WRIST", ""]),
    of("small, glued", SMALL_L_R, [
        "hip abdomen chest neck head",
        "{}hip {}knee {}ankle {}toe",
        "{}collar {}shoulder {}elbow {}wrist", ""]),
    of("small, glued, words of two", ["left", "right"], [
        "hips lowerback upperback neck head",
        "{}upperleg {}lowerleg {}foot {}toebase",
        "{}clavicle {}upperarm {}forearm {}hand", ""]),
    of("side behind, glued", SMALL_L_R, [
        "pelvis spine chest neck head",
        "thigh{} calf{} foot{} ball{}",
        "clavicle{} upperarm{} lowerarm{} hand{}", ""]),
    of("camel case", ["left", "right"], [
        "hips spine chest neck head",
        "{}UpperLeg {}LowerLeg {}Foot {}Toes",
        "{}Shoulder {}UpperArm {}LowerArm {}Hand", ""]),
    of("words with a suffix for all", L_R, [
        "hips_jnt spine_jnt chest_jnt neck_jnt head_jnt",
        "{}_up_leg_jnt {}_low_leg_jnt {}_foot_jnt {}_toe_jnt",
        "{}_clav_jnt {}_up_arm_jnt {}_low_arm_jnt {}_hand_jnt",
        "root_jnt>hips_jnt {}_up_arm_twist_jnt<{}_up_arm_jnt"]),
    of("numbers for names of bones", ["left", "right"], [
        "body_pelvis body_spine_1 body_spine_2 body_neck body_head",
        "{}_leg_1 {}_leg_2 {}_foot {}_toe",
        "{}_clavicle {}_arm_1 {}_arm_2 {}_hand", ""]),
    of("German", ["L", "R"], [
        "Becken Wirbelsäule Brust Hals Kopf",
        "Oberschenkel.{} Unterschenkel.{} Fuß.{} Zehen.{}",
        "Schlüsselbein.{} Oberarm.{} Unterarm.{} Hand.{}", ""]),
    of("Spanish", ["izq", "der"], [
        "cadera columna pecho cuello cabeza",
        "muslo_{} pantorrilla_{} pie_{} dedos_{}",
        "clavicula_{} brazo_{} antebrazo_{} mano_{}", ""]),
    of("Chinese", ["左", "右"], [
        "骨盆 脊柱 胸 颈 头",
        "{}大腿 {}小腿 {}脚 {}脚趾",
        "{}锁骨 {}上臂 {}前臂 {}手", ""]),
];
